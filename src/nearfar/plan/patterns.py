"""Patterns as data: the content of each projected pattern, and its purpose."""

from abc import ABC, abstractmethod
from functools import cache, lru_cache
from typing import Annotated, Any, Literal, Union

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    SerializeAsAny,
    SerializerFunctionWrapHandler,
    TypeAdapter,
    field_validator,
    model_serializer,
)

from nearfar.arrays import Size
from nearfar.errors import PlanError
from nearfar.illumination import patterns
from nearfar.illumination.frequencies import Frequency, frequency_from_text, frequency_to_text
from nearfar.illumination.pictures import natural_picture
from nearfar.plan.recognition.contents import AnyContent

# Codes of more lamps take longer to read than to be shown one by one.
MOST_LAMPS_OF_A_CODE = 2**14

Purpose = Literal["direct", "near", "far", "reference", "correspondence", "check", "shown"]

FrequencyField = Annotated[
    Frequency,
    BeforeValidator(frequency_from_text),
    PlainSerializer(frequency_to_text),
]


class Frozen(BaseModel):
    """Data that never changes and refuses keys that it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True)


class Pattern(Frozen, ABC):
    """The pattern that is projected for one photo.

    A kind of pattern is a subclass: it narrows `kind` to a literal of its own, by which it is found
    again in a file, adds what `draw` needs, and gives `purpose` a default.

    Attributes
    ----------
    kind : str
    purpose : {"direct", "near", "far", "reference", "correspondence", "check", "shown"}
    """

    kind: str
    purpose: Purpose

    @abstractmethod
    def draw(self, size: Size) -> NDArray[np.uint8]:
        """Draw the 8-bit pattern, shape (Py, Px)."""

    @property
    def description(self) -> str:
        """The pattern in a few words."""
        return self.kind

    def require_place_on(self, projector: Size) -> None:
        """Refuse a pattern that does not fit a projector; one that fits any does nothing.

        Raises
        ------
        ValueError
        """

    @model_serializer(mode="wrap")
    def _purpose_last(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        # The order in which plan files have always had the keys.
        data: dict[str, Any] = handler(self)
        purpose = data.pop("purpose")
        return {**data, "purpose": purpose}


class Sinusoid(Pattern):
    """A cosine or sine with offset, or the inverse of one."""

    kind: Literal["cosine", "sine"]
    frequency: FrequencyField
    inverse: bool = False
    purpose: Purpose

    @property
    def description(self) -> str:
        """The pattern in a few words."""
        return f"{_with_frequency(self.kind, self.frequency)}{', inverse' if self.inverse else ''}"

    def draw(self, size: Size) -> NDArray[np.uint8]:
        """Draw the 8-bit pattern, shape (Py, Px)."""
        wave = patterns.cosine if self.kind == "cosine" else patterns.sine
        drawn = patterns.draw_wave(wave, self.frequency, size)
        return patterns.invert(drawn) if self.inverse else drawn


class Exponential(Pattern):
    """exp(-j 2 pi k.p): the theory's pattern, for simulation only."""

    kind: Literal["exponential"] = "exponential"
    frequency: FrequencyField
    purpose: Purpose

    @property
    def description(self) -> str:
        """The pattern in a few words."""
        return _with_frequency(self.kind, self.frequency)

    def draw(self, size: Size) -> NDArray[np.uint8]:
        """Refuse: no projector can display complex values.

        Raises
        ------
        PlanError
        """
        raise PlanError(
            f"the {self.description} is complex and cannot be drawn on a projector of {size}."
        )


class Stripe(Pattern):
    """One black row or column on white, for correspondence."""

    kind: Literal["black row", "black column"]
    index: int = Field(ge=0)
    purpose: Purpose = "correspondence"

    @property
    def description(self) -> str:
        """The pattern in a few words."""
        return f"{self.kind} {self.index}"

    def draw(self, size: Size) -> NDArray[np.uint8]:
        """Draw the 8-bit pattern, shape (Py, Px)."""
        shape = patterns.black_row if self.kind == "black row" else patterns.black_column
        return patterns.quantise(shape(self.index, size))

    def require_place_on(self, projector: Size) -> None:
        """Refuse a row or column that the projector does not have.

        Raises
        ------
        ValueError
        """
        if self.index >= projector[0 if self.kind == "black row" else 1]:
            raise ValueError(f"{self.description} is outside the projector")


class GrayCode(Pattern):
    """One bit of the Gray code of all rows or columns, or its inverse, for correspondence."""

    kind: Literal["gray rows", "gray columns"]
    bit: int = Field(ge=0)
    inverse: bool = False
    purpose: Purpose = "correspondence"

    @property
    def description(self) -> str:
        """The pattern in a few words."""
        return f"{self.kind}, bit {self.bit}{', inverse' if self.inverse else ''}"

    def draw(self, size: Size) -> NDArray[np.uint8]:
        """Draw the 8-bit pattern, shape (Py, Px)."""
        shape = patterns.gray_rows if self.kind == "gray rows" else patterns.gray_columns
        drawn = patterns.quantise(shape(self.bit, size))
        return patterns.invert(drawn) if self.inverse else drawn

    def require_place_on(self, projector: Size) -> None:
        """Refuse a bit that no row or column number of the projector has.

        Raises
        ------
        ValueError
        """
        if self.bit >= patterns.gray_bits(projector[0 if self.kind == "gray rows" else 1]):
            raise ValueError(f"{self.kind} have no bit {self.bit} on the projector")


class Picture(Pattern):
    """A natural picture that no estimate sees, or its inverse, to check relighting by."""

    kind: Literal["picture"] = "picture"
    seed: int = Field(ge=0)
    inverse: bool = False
    purpose: Literal["check"] = "check"

    @property
    def description(self) -> str:
        """The pattern in a few words."""
        return f"picture {self.seed} to check by{', inverse' if self.inverse else ''}"

    def draw(self, size: Size) -> NDArray[np.uint8]:
        """Draw the 8-bit pattern, shape (Py, Px)."""
        drawn = _picture(size, self.seed)
        return patterns.invert(drawn) if self.inverse else drawn.copy()


# Each picture is shown twice, and again compared with in each estimate of a capture. Those of a
# thousand photos are kept.
@lru_cache(maxsize=16)
def _picture(size: Size, seed: int) -> NDArray[np.uint8]:
    return patterns.quantise(natural_picture(size, seed).astype(np.float64))


class HalfScreen(Pattern):
    """Half of the screen white and the other half black, or its inverse, to check relighting by."""

    kind: Literal["left half-screen", "top half-screen"]
    inverse: bool = False
    purpose: Literal["check"] = "check"

    @property
    def description(self) -> str:
        """The pattern in a few words."""
        return f"{self.kind} to check by{', inverse' if self.inverse else ''}"

    def draw(self, size: Size) -> NDArray[np.uint8]:
        """Draw the 8-bit pattern, shape (Py, Px)."""
        shape = patterns.left_half if self.kind == "left half-screen" else patterns.top_half
        drawn = patterns.quantise(shape(size))
        return patterns.invert(drawn) if self.inverse else drawn


class LampCode(Pattern):
    """A row of a cyclic S-matrix: about half of the lamps at full white, in no order.

    Attributes
    ----------
    order : int
        A prime of the form 4 m + 3, not below the number of projector pixels.
    row : int
        Pixel p, counted row by row, is white where (row + p) modulo the order is a square modulo
        the order (Harwit and Sloane, Hadamard Transform Optics, 1979).
    """

    kind: Literal["lamp code"] = "lamp code"
    order: int = Field(ge=3, le=MOST_LAMPS_OF_A_CODE)
    row: int = Field(ge=0)
    purpose: Literal["direct", "check"] = "direct"

    @property
    def description(self) -> str:
        """The pattern in a few words."""
        to_check = " to check by" if self.purpose == "check" else ""
        return f"code {self.row} of {self.order} lamps{to_check}"

    def draw(self, size: Size) -> NDArray[np.uint8]:
        """Draw the 8-bit pattern, shape (Py, Px)."""
        return patterns.quantise(patterns.s_matrix_row(self.order, self.row, size))

    def require_place_on(self, projector: Size) -> None:
        """Refuse a code of fewer lamps than a projector has, or a row that it does not have.

        Raises
        ------
        ValueError
        """
        if self.order % 4 != 3 or not patterns.is_prime(self.order):
            raise ValueError(f"there are no codes of order {self.order}")
        if self.order < projector.pixels or self.row >= self.order:
            raise ValueError(f"{self.description} does not fit the projector")


class Shown(Pattern):
    """A picture of somebody else's that was shown; its pixels are kept in the capture.

    Attributes
    ----------
    content : Content
        What the picture was recognised as.
    inverse_of : int or None
        Number of the earlier pattern whose inverse it is.
    """

    kind: Literal["shown"] = "shown"
    content: AnyContent
    inverse_of: int | None = Field(default=None, ge=0)
    purpose: Literal["shown"] = "shown"

    @property
    def description(self) -> str:
        """The pattern in a few words."""
        described: str = self.content.description
        return described

    def draw(self, size: Size) -> NDArray[np.uint8]:
        """Refuse: a plan does not hold the picture's pixels.

        Raises
        ------
        PlanError
        """
        raise PlanError(
            f"the {self.description} is a picture on a projector of {size}, which is kept in its "
            f"capture alone: ask that capture for its pattern."
        )


class SideBySide(Pattern):
    """One pattern on several projectors, on some of them inverted; see `nearfar.plan.sharing`.

    The pattern grids of the projectors are side by side, in one that is as wide as all of them.

    Attributes
    ----------
    pattern : Pattern
    inverted : tuple of bool
        Of each projector, whether it shows the inverse: 255 minus the 8-bit pattern.
    """

    kind: Literal["side by side"] = "side by side"
    pattern: SerializeAsAny[Pattern]
    inverted: tuple[bool, ...] = Field(min_length=2)
    purpose: Purpose

    @field_validator("pattern", mode="before")
    @classmethod
    def _pattern_is_of_nearfars_own(cls, value: Any) -> Any:
        return pattern_reader(()).validate_python((value,))[0]

    @property
    def description(self) -> str:
        """The pattern in a few words."""
        shown = ", ".join("inverse" if inverted else "as it is" for inverted in self.inverted)
        return f"{self.pattern.description} on {len(self.inverted)} projectors: {shown}"

    def draw(self, size: Size) -> NDArray[np.uint8]:
        """Draw the 8-bit pattern, shape (Py, Px)."""
        drawn = self.pattern.draw(self._grid(size))
        return np.hstack([patterns.invert(drawn) if one else drawn for one in self.inverted])

    def require_place_on(self, projector: Size) -> None:
        """Refuse a width that is not the same for all projectors, and as the pattern does.

        Raises
        ------
        ValueError
        """
        if projector.width % len(self.inverted):
            raise ValueError(f"{self.description} do not fit side by side on {projector}")
        self.pattern.require_place_on(self._grid(projector))

    def _grid(self, size: Size) -> Size:
        return Size(size.height, size.width // len(self.inverted))


OWN_PATTERNS: tuple[type[Pattern], ...] = (
    Sinusoid,
    Exponential,
    Stripe,
    GrayCode,
    Picture,
    HalfScreen,
    LampCode,
    Shown,
    SideBySide,
)


def kinds_of(pattern: type[Pattern]) -> frozenset[str]:
    """Return the kinds that a subclass of `Pattern` stands for."""
    return frozenset(getattr(pattern.model_fields["kind"].annotation, "__args__", ()))


@cache
def pattern_reader(added: tuple[type[Pattern], ...]) -> TypeAdapter[tuple[Pattern, ...]]:
    """Return the pydantic adapter that validates nearfar's own patterns and further types."""
    # Made at run time, so that no type checker follows it.
    union: Any = Union
    annotated: Any = Annotated
    sequence: Any = tuple
    kind = annotated[union[(*OWN_PATTERNS, *added)], Field(discriminator="kind")]
    return TypeAdapter(sequence[kind, ...])


def _with_frequency(kind: str, frequency: Frequency) -> str:
    return f"{kind} of frequency ({frequency.fy}, {frequency.fx})"
