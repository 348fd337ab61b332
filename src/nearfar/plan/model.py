"""The plan: the patterns to project, their order, and the purpose of each."""

import json
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    BeforeValidator,
    Field,
    PlainSerializer,
    SerializeAsAny,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic_core import PydanticCustomError

from nearfar.arrays import AnyPath, Floats, Size, as_size
from nearfar.errors import MissingFileError, PlanError, UnreadableFileError
from nearfar.plan.correspondence import CORRESPONDENCE_METHODS, pattern_types_of
from nearfar.plan.expected_range import ExpectedRange
from nearfar.plan.patterns import (
    OWN_PATTERNS,
    Exponential,
    Frozen,
    LampCode,
    Pattern,
    Purpose,
    SideBySide,
    kinds_of,
    pattern_reader,
)

# Also a literal in the model. Version 2 added phase, repeated patterns and check pictures, version
# 3 Gray code, version 4 half-screens and inverse pictures, version 5 the pitch, version 6 the
# expected SNR_b, version 7 pictures that were shown and codes of lamps. A plan of an earlier
# version is one of the next as well.
FORMAT_VERSION = 7
READABLE_VERSIONS = (1, 2, 3, 4, 5, 6, 7)

# Characters of a message that are quoted from a plan.
MAXIMUM_REASON = 200
MAXIMUM_NAME = 60

PURPOSES: tuple[Purpose, ...] = ("direct", "near", "far", "reference", "correspondence", "check")


# Patterns of a longer side are averaged for a notebook's card.
SIDE_ON_A_CARD = 256

# No projector has a longer side.
LARGEST_SIDE = 16384

SizeField = Annotated[Size, BeforeValidator(as_size), PlainSerializer(list)]


# Type of the errors of what another package has to bring.
NOT_INSTALLED = "not_installed"


class Plan(Frozen):
    """Patterns to project: one for each photo, in the order to shoot.

    A pattern may stand in it several times: its photos are averaged.

    Attributes
    ----------
    projector : Size
        Pattern grid.
    window : int
        W of the near-range window, W x W functions; 1 x W on a projector of one row, W x 1 of one
        column.
    pitch : int
        Projector pixels between neighbouring functions of the window, a power of two; 1 for the
        paper's window of single pixels.
    far, dropped : Size
        Far band, and the block of lowest near frequencies that are not shot.
    offset : {"inverse", "reference", "none", "shown"}
        Inverse pairs, whites and blacks at intervals for all, or none (complex patterns, for
        simulation); "shown" for pictures of somebody else's, which are as they are.
    correspondence : str
        Name of a method of `nearfar.plan.correspondence.CORRESPONDENCE_METHODS`: photos of
        "stripes" or of "gray" code, the "phase" of the transport's own photos, "none" at all, or
        a method that another package adds.
    expected_snr : ExpectedRange or None
        SNR_b in dB that the plan was chosen for; None if it was not chosen for any.
    patterns : tuple of Pattern

    Examples
    --------
    >>> plan
    <nearfar plan: projector 8x8, 52 photos>
    >>> plan.counts["near"], plan.counts["correspondence"]
    (16, 16)
    >>> plan.draw(0).shape  # the 8-bit pattern of the first photo
    (8, 8)
    """

    format: Literal["nearfar plan"] = "nearfar plan"
    version: Literal[7] = 7
    projector: SizeField
    window: int = Field(ge=1, strict=True)
    pitch: int = Field(default=1, ge=1, le=LARGEST_SIDE, strict=True)
    far: SizeField
    dropped: SizeField
    offset: Literal["inverse", "reference", "none", "shown"]
    correspondence: str
    expected_snr: ExpectedRange | None = None
    patterns: tuple[SerializeAsAny[Pattern], ...]

    @field_validator("correspondence")
    @classmethod
    def _correspondence_is_installed(cls, name: str) -> str:
        if name not in CORRESPONDENCE_METHODS:
            raise PydanticCustomError(
                NOT_INSTALLED,
                "needs the correspondence method {name}, which is not installed: install the "
                "package that adds it, or make the plan with one of {known}",
                {"name": repr(name[:MAXIMUM_NAME]), "known": ", ".join(CORRESPONDENCE_METHODS)},
            )
        return name

    @field_validator("pitch")
    @classmethod
    def _pitch_is_a_power_of_two(cls, pitch: int) -> int:
        if pitch & (pitch - 1):
            raise ValueError(f"a pitch of {pitch} is not a power of two")
        return pitch

    @field_validator("patterns", mode="before")
    @classmethod
    def _patterns_are_of_known_kinds(cls, values: Any, info: ValidationInfo) -> Any:
        unknown = _kinds_in(values) - _OWN_KINDS
        # The methods of nearfar are not loaded for patterns that nearfar has anyway.
        method = info.data.get("correspondence")
        added = pattern_types_of(method) if unknown and method is not None else ()
        if unknown := unknown.difference(*map(kinds_of, added)):
            raise PydanticCustomError(
                NOT_INSTALLED,
                "has patterns of the kind {kind}, which neither nearfar nor its correspondence "
                "method has: install the package that adds that kind, or make the plan again with "
                "'nearfar plan -o'",
                {"kind": repr(min(unknown)[:MAXIMUM_NAME])},
            )
        return pattern_reader(added).validate_python(values)

    @model_validator(mode="after")
    def _is_a_plan_for_the_projector(self) -> "Plan":
        # Before anybody works with them for minutes.
        widest = self.projector if min(self.projector) > 1 else _square(max(self.projector))
        window = _square(self.pitch * (self.window - 1) + 1)
        for name, size, largest in (
            ("projector", self.projector, Size(LARGEST_SIDE, LARGEST_SIDE)),
            ("window", window, widest),
            ("far", self.far, self.projector),
            ("dropped", self.dropped, _square(self.window)),
        ):
            if size.height > largest.height or size.width > largest.width:
                raise ValueError(f"its {name} of {size} is larger than {largest}")
        if not self.transport_photos and self.offset != "shown":
            raise ValueError("it has no photos of transport: direct, near or far")
        return self

    @model_validator(mode="after")
    def _patterns_lie_on_the_projector(self) -> "Plan":
        for pattern in self.patterns:
            pattern.require_place_on(self.projector)
        return self

    @property
    def counts(self) -> dict[Purpose, int]:
        """Number of photos for each purpose."""
        # Not cached: a copy with other patterns would take the cached counts along.
        counted: Counter[Purpose] = Counter(pattern.purpose for pattern in self.patterns)
        return {**dict.fromkeys(PURPOSES, 0), **counted}

    @property
    def transport_photos(self) -> int:
        """Photos of transport: direct, near and far."""
        counts = self.counts
        return sum(counts[purpose] for purpose in ("direct", "near", "far"))

    @property
    def savings(self) -> float:
        """Brute force over photos of transport (equation 13)."""
        return self.projector.pixels / (self.transport_photos or len(self.patterns))

    def summary(self) -> dict[str, Any]:
        """Return the numbers that ``nearfar plan --json`` prints."""
        return {
            "photos": self.counts,
            "transport_photos": self.transport_photos,
            "total_photos": len(self.patterns),
            "brute_force": self.projector.pixels,
            "savings": self.savings,
        }

    def first(self, count: int) -> "Plan":
        """Return the plan of the first photos alone; what all were expected to reach is dropped."""
        if count >= len(self.patterns):
            return self
        return self.model_copy(update={"patterns": self.patterns[:count], "expected_snr": None})

    def require_real(self, what: str) -> None:
        """Refuse a plan of complex patterns, which are for simulation without noise only.

        Raises
        ------
        PlanError
            If the plan has offset none.
        """
        if self.offset == "none":
            raise PlanError(
                f"a plan with `offset='none'` has complex patterns, which no projector can show, "
                f"so there is nothing to {what}: make the plan with `offset='inverse'`."
            )

    def require_sinusoids(self, what: str) -> None:
        """Refuse a plan whose patterns are not sinusoids: pictures that were shown, codes of lamps.

        Raises
        ------
        PlanError
            If the plan has offset "shown", codes of lamps, or photos that projectors share.
        """
        self.require_one_projector(what)
        if self.offset == "shown":
            raise PlanError(
                f"these photos are of somebody else's pictures, not of the sinusoids of a plan, so "
                f"that there is nothing to {what}: go on with `correspond()` or `reconstruct()`."
            )
        if self.is_of_lamps:
            raise PlanError(
                f"these photos are of codes of lamps, not of sinusoids, so that there is nothing "
                f"to {what}: go on with `reconstruct(no_near=True, no_far=True)`."
            )

    def require_one_projector(self, what: str) -> None:
        """Refuse a plan whose photos several projectors share.

        Raises
        ------
        PlanError
        """
        if any(isinstance(pattern, SideBySide) for pattern in self.patterns):
            raise PlanError(
                f"these photos show several projectors at once, so that there is nothing to {what} "
                f"in them: go on with the capture of each projector, which was written beside them."
            )

    @property
    def is_by_codes(self) -> bool:
        """Whether the plan shows codes, which measure all frequencies together."""
        return any(isinstance(pattern, LampCode) for pattern in self.patterns)

    @property
    def is_of_lamps(self) -> bool:
        """Whether the plan shows codes of lamps without a neighbourhood."""
        return self.is_by_codes and self.correspondence == "none"

    def draw(self, index: int) -> NDArray[np.uint8]:
        """Draw the 8-bit pattern of photo `index`, shape (Py, Px)."""
        pattern = self.patterns[index]
        if isinstance(pattern, Exponential):
            self.require_real("draw")
        return pattern.draw(self.projector)

    def __repr__(self) -> str:
        return f"<nearfar plan: projector {self.projector}, {len(self.patterns)} photos>"

    # Pydantic's own lists every pattern.
    __str__ = __repr__

    def _repr_html_(self) -> str:
        """Show the plan in a notebook."""
        # Plans are made without what pictures need.
        from nearfar.markup import card, picture

        counted = ", ".join(f"{count} {name}" for name, count in self.counts.items() if count)
        rows = [
            ("projector", str(self.projector)),
            ("window W, its pitch, far band", f"{self.window}, {self.pitch}, {self.far}"),
            ("offset, correspondence", f"{self.offset}, {self.correspondence}"),
            ("photos", f"{len(self.patterns)}: {counted}"),
            ("brute force over photos of transport", f"{self.savings:.2f}"),
        ]
        chosen = (
            [] if self.offset in {"none", "shown"} else [0, *range(3, len(self.patterns), 7)][:5]
        )
        images = [(f"pattern {i}", picture(_small(self.draw(i)), "")) for i in chosen]
        return card("plan", rows, images)

    def to_json(self) -> str:
        """Write the plan as JSON text, a pattern per line."""
        data = self.model_dump(mode="json")
        lines = ",\n".join(f"    {json.dumps(pattern)}" for pattern in data.pop("patterns"))
        head = ",\n".join(f"  {json.dumps(key)}: {json.dumps(data[key])}" for key in data)
        return f'{{\n{head},\n  "patterns": [\n{lines}\n  ]\n}}\n'


def _small(drawn: NDArray[np.uint8]) -> Floats:
    """Return a pattern in [0, 1] for the card of a notebook: averages where it has many pixels."""
    side = -(-max(drawn.shape) // SIDE_ON_A_CARD)
    if side == 1 or min(drawn.shape) < side:
        return np.asarray(drawn / np.float32(255))
    height, width = (length // side for length in drawn.shape)
    cut = drawn[: height * side, : width * side]
    averaged = cut.reshape(height, side, width, side).mean(axis=(1, 3), dtype=np.float32)
    return np.asarray(averaged / np.float32(255))


def _square(side: int) -> Size:
    return Size(side, side)


_OWN_KINDS = frozenset[str]().union(*map(kinds_of, OWN_PATTERNS))


def _kinds_in(values: Any) -> frozenset[str]:
    """Return the kinds of patterns, or of their JSON, that have one."""
    kinds = (
        value.get("kind") if isinstance(value, Mapping) else getattr(value, "kind", None)
        for value in (values if isinstance(values, list | tuple) else ())
    )
    return frozenset(kind for kind in kinds if isinstance(kind, str))


def parse_plan(text: str, *, source: str = "plan") -> Plan:
    """Read a plan from JSON text.

    Raises
    ------
    UnreadableFileError
        If the text is no plan, or a plan of another version; the message says which.

    Examples
    --------
    >>> nearfar.parse_plan(plan.to_json()) == plan
    True
    """
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise UnreadableFileError(
            f"{source} is not a plan: it is no JSON ({error}); make one with 'nearfar plan -o'."
        ) from None
    if not isinstance(data, dict) or data.get("format") != "nearfar plan":
        raise UnreadableFileError(
            f"{source} is not a nearfar plan: make one with 'nearfar plan -o'."
        )
    if data.get("version") not in READABLE_VERSIONS:
        version = repr(data.get("version"))[:MAXIMUM_REASON]
        raise UnreadableFileError(
            f"{source} is a plan of version {version}, this nearfar reads versions "
            f"1 to {FORMAT_VERSION}: make the plan again, or use the nearfar that "
            f"made it."
        )
    try:
        return Plan.model_validate(data | {"version": FORMAT_VERSION})
    except ValidationError as error:
        first = error.errors()[0]
        if first["type"] == NOT_INSTALLED:
            raise UnreadableFileError(f"{source} {first['msg']}.") from None
        where = ".".join(str(part) for part in first["loc"]) or "plan"
        reason = " ".join(first["msg"].removeprefix("Value error, ").split()).rstrip(".")
        raise UnreadableFileError(
            f"{source} is a damaged plan: {where}: {reason[:MAXIMUM_REASON]}; make it again with "
            f"'nearfar plan -o'."
        ) from None


def read_plan(path: AnyPath) -> Plan:
    """Read a plan file.

    Raises
    ------
    MissingFileError, UnreadableFileError

    Examples
    --------
    >>> with open("plan.json", "w") as file:
    ...     _ = file.write(plan.to_json())
    >>> nearfar.read_plan("plan.json") == plan
    True
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise MissingFileError(
            f"{path} is not there: make a plan with 'nearfar plan -o {path}'."
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is no text"
        raise UnreadableFileError(
            f"{path} cannot be read as a plan ({reason}): name a file that 'nearfar plan -o' wrote."
        ) from None
    return parse_plan(text, source=str(path))
