"""The plan: frozen data that says what to project, in what order, and what for."""

import json
from collections import Counter
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    ValidationError,
    model_validator,
)

from nearfar.arrays import AnyPath, Size, as_size
from nearfar.errors import MissingFileError, PlanError, UnreadableFileError
from nearfar.illumination import patterns
from nearfar.illumination.frequencies import (
    Frequency,
    frequency_from_text,
    frequency_to_text,
)
from nearfar.illumination.pictures import natural_picture

# Stands in the model as a literal, too. Version 2 knows phase, repeats and pictures to check by,
# version 3 Gray code; all of an earlier version is of the next as well.
FORMAT_VERSION = 3
READABLE = (1, 2, 3)

Purpose = Literal["direct", "near", "far", "reference", "correspondence", "check"]
PURPOSES: tuple[Purpose, ...] = ("direct", "near", "far", "reference", "correspondence")


FrequencyField = Annotated[
    Frequency,
    BeforeValidator(frequency_from_text),
    PlainSerializer(frequency_to_text),
]
SizeField = Annotated[Size, BeforeValidator(as_size), PlainSerializer(list)]


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True)


class Sinusoid(_Frozen):
    """A cosine or sine with offset, or the inverse of one."""

    kind: Literal["cosine", "sine"]
    frequency: FrequencyField
    inverse: bool = False
    purpose: Purpose

    def draw(self, size: Size) -> NDArray[np.uint8]:
        """Draw the 8-bit pattern, shape (Py, Px)."""
        shape = patterns.cosine if self.kind == "cosine" else patterns.sine
        shown = patterns.quantise(shape(self.frequency, size))
        return patterns.invert(shown) if self.inverse else shown


class Exponential(_Frozen):
    """exp(-j 2 pi k.p): the theory's pattern, for simulation only."""

    kind: Literal["exponential"] = "exponential"
    frequency: FrequencyField
    purpose: Purpose


class Stripe(_Frozen):
    """One black row or column on white, for correspondence."""

    kind: Literal["black row", "black column"]
    index: int = Field(ge=0)
    purpose: Purpose = "correspondence"

    def draw(self, size: Size) -> NDArray[np.uint8]:
        """Draw the 8-bit pattern, shape (Py, Px)."""
        shape = patterns.black_row if self.kind == "black row" else patterns.black_column
        return patterns.quantise(shape(self.index, size))


class GrayCode(_Frozen):
    """One bit of the Gray code of all rows or columns, or its inverse, for correspondence."""

    kind: Literal["gray rows", "gray columns"]
    bit: int = Field(ge=0)
    inverse: bool = False
    purpose: Purpose = "correspondence"

    def draw(self, size: Size) -> NDArray[np.uint8]:
        """Draw the 8-bit pattern, shape (Py, Px)."""
        shape = patterns.gray_rows if self.kind == "gray rows" else patterns.gray_columns
        shown = patterns.quantise(shape(self.bit, size))
        return patterns.invert(shown) if self.inverse else shown


class Picture(_Frozen):
    """A natural picture that no estimate sees, to check relighting by."""

    kind: Literal["picture"] = "picture"
    seed: int = Field(ge=0)
    purpose: Literal["check"] = "check"

    def draw(self, size: Size) -> NDArray[np.uint8]:
        """Draw the 8-bit pattern, shape (Py, Px)."""
        return patterns.quantise(natural_picture(size, self.seed).astype(np.float64))


Pattern = Annotated[
    Sinusoid | Exponential | Stripe | GrayCode | Picture, Field(discriminator="kind")
]


class Plan(_Frozen):
    """What to project: one pattern for each photo, in the order to shoot.

    A pattern may stand in it several times: its photos are averaged.

    Attributes
    ----------
    projector : Size
        Pattern grid.
    window : int
        W of the near-range window.
    far, dropped : Size
        Far band, and the block of lowest near frequencies that are not shot.
    offset : {"inverse", "reference", "none"}
        Inverse pairs, whites and blacks at intervals for all, or none (complex patterns, for
        simulation).
    correspondence : {"stripes", "gray", "phase", "none"}
        Photos of stripes or of Gray code, the phase of the transport's own photos, or none at all.
    patterns : tuple of Sinusoid, Exponential, Stripe, GrayCode or Picture

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
    version: Literal[3] = 3
    projector: SizeField
    window: int = Field(ge=1)
    far: SizeField
    dropped: SizeField
    offset: Literal["inverse", "reference", "none"]
    correspondence: Literal["stripes", "gray", "phase", "none"]
    patterns: tuple[Pattern, ...]

    @model_validator(mode="after")
    def _patterns_lie_on_the_projector(self) -> "Plan":
        for pattern in self.patterns:
            if isinstance(pattern, GrayCode):
                side = self.projector[0 if pattern.kind == "gray rows" else 1]
                if pattern.bit >= patterns.gray_bits(side):
                    raise ValueError(f"{pattern.kind} have no bit {pattern.bit} on the projector")
            if isinstance(pattern, Stripe):
                rows = pattern.kind == "black row"
                if pattern.index >= (self.projector.height if rows else self.projector.width):
                    raise ValueError(f"{pattern.kind} {pattern.index} is outside the projector")
        return self

    @cached_property
    def counts(self) -> dict[Purpose, int]:
        """Photos for each purpose; of checks where there are any."""
        counted: Counter[Purpose] = Counter(pattern.purpose for pattern in self.patterns)
        return {**dict.fromkeys(PURPOSES, 0), **counted}

    @property
    def transport_photos(self) -> int:
        """Photos of transport: direct, near and far."""
        return sum(self.counts[purpose] for purpose in ("direct", "near", "far"))

    @property
    def savings(self) -> float:
        """Brute force over photos of transport (equation 13)."""
        return self.projector.pixels / self.transport_photos

    def summary(self) -> dict[str, Any]:
        """Return what ``nearfar plan --json`` prints."""
        return {
            "photos": self.counts,
            "transport_photos": self.transport_photos,
            "total_photos": len(self.patterns),
            "brute_force": self.projector.pixels,
            "savings": self.savings,
        }

    def first(self, count: int) -> "Plan":
        """Return the plan of the first photos alone."""
        return self.model_copy(update={"patterns": self.patterns[:count]})

    def require_real(self, what: str) -> None:
        """Refuse a plan of complex patterns for anything but simulation by theory.

        Raises
        ------
        PlanError
            If the plan has offset none.
        """
        if self.offset == "none":
            raise PlanError(
                f"a plan with --offset none has complex patterns, which no projector can show, "
                f"so there is nothing to {what}: make the plan with --offset inverse."
            )

    def draw(self, index: int) -> NDArray[np.uint8]:
        """Draw the 8-bit pattern of photo `index`, shape (Py, Px)."""
        pattern = self.patterns[index]
        if isinstance(pattern, Exponential):
            self.require_real("draw")
            raise PlanError(f"pattern {index} of the plan is complex and cannot be drawn.")
        return pattern.draw(self.projector)

    def __repr__(self) -> str:
        return f"<nearfar plan: projector {self.projector}, {len(self.patterns)} photos>"

    def _repr_html_(self) -> str:
        """Show the plan in a notebook."""
        # Plans are made without what pictures need.
        from nearfar.markup import card, picture

        counted = ", ".join(f"{count} {name}" for name, count in self.counts.items() if count)
        rows = [
            ("projector", str(self.projector)),
            ("window W, far band", f"{self.window}, {self.far}"),
            ("offset, correspondence", f"{self.offset}, {self.correspondence}"),
            ("photos", f"{len(self.patterns)}: {counted}"),
            ("brute force over photos of transport", f"{self.savings:.2f}"),
        ]
        shown = [] if self.offset == "none" else [0, *range(3, len(self.patterns), 7)][:5]
        images = [(f"pattern {i}", picture(self.draw(i) / np.float32(255), "")) for i in shown]
        return card("plan", rows, images)

    def to_json(self) -> str:
        """Write the plan as JSON text, a pattern per line."""
        data = self.model_dump(mode="json")
        lines = ",\n".join(f"    {json.dumps(pattern)}" for pattern in data.pop("patterns"))
        head = ",\n".join(f"  {json.dumps(key)}: {json.dumps(data[key])}" for key in data)
        return f'{{\n{head},\n  "patterns": [\n{lines}\n  ]\n}}\n'


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
    except ValueError as error:
        raise UnreadableFileError(
            f"{source} is not a plan: it is no JSON ({error}); make one with 'nearfar plan -o'."
        ) from None
    if not isinstance(data, dict) or data.get("format") != "nearfar plan":
        raise UnreadableFileError(
            f"{source} is not a nearfar plan: make one with 'nearfar plan -o'."
        )
    if data.get("version") not in READABLE:
        raise UnreadableFileError(
            f"{source} is a plan of version {data.get('version')!r}, this nearfar reads versions "
            f"1 to {FORMAT_VERSION}: make the plan again, or use the nearfar that "
            f"made it."
        )
    try:
        return Plan.model_validate(data | {"version": FORMAT_VERSION})
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "plan"
        raise UnreadableFileError(
            f"{source} is a damaged plan: {where}: {first['msg']}; make it again with "
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
