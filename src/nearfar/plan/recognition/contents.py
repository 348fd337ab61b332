"""The content of a picture that was shown as a pattern, as data.

A binary picture has two levels: its dark one counts as 0 and its bright one as 1, whatever their
values. An axis is "rows" where a picture differs from row to row alone, and "columns" where it
differs from column to column alone.
"""

from math import hypot
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

Axis = Literal["rows", "columns"]


class Content(BaseModel):
    """What a picture shows.

    Attributes
    ----------
    kind : str
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: str

    @property
    def description(self) -> str:
        """The content in a few words."""
        return self.kind


class Uniform(Content):
    """One level everywhere."""

    kind: Literal["uniform"] = "uniform"
    level: float

    @property
    def description(self) -> str:
        """The content in a few words."""
        if self.level in {0.0, 1.0}:
            return "white" if self.level else "black"
        return f"grey of {self.level:.3g}"


def rounded_period(period: float) -> float:
    """Return a period as precisely as pictures tell it: 3 digits, or whole pixels."""
    return float(f"{period:.3g}") if period < 100 else float(round(period))


class Fringes(Content):
    """A sinusoid mean + amplitude cos(2 pi k.p + phase).

    Attributes
    ----------
    fy, fx : float
        Cycles per pixel of the picture; fy > 0, or fy = 0 and fx > 0.
    phase : float
        In cycles, from 0 to 1, at the first pixel.
    mean, amplitude : float
    exponent : float
        Power that the file's values were raised to before this sinusoid was found in them; 1 where
        they are the sinusoid's.
    """

    kind: Literal["fringes"] = "fringes"
    fy: float
    fx: float
    phase: float
    mean: float
    amplitude: float
    exponent: float = 1.0

    @property
    def period(self) -> float:
        """Pixels from one crest to the next."""
        return 1.0 / hypot(self.fy, self.fx)

    @property
    def description(self) -> str:
        """The content in a few words."""
        phase, period = round(self.phase, 3) % 1.0, rounded_period(self.period)
        return f"fringes {self.direction}, period {period:g}, phase {phase:.3f} cycles"

    @property
    def direction(self) -> str:
        """Where the fringes lead, in words."""
        if not self.fy or not self.fx:
            return "of columns" if self.fx else "of rows"
        return f"along ({self.fy:.4g}, {self.fx:.4g}) cycles a pixel"


class GrayBit(Content):
    """One bit of the Gray code of row or column numbers.

    Attributes
    ----------
    axis : {"rows", "columns"}
    bit : int
        0 the finest.
    cell : int
        Rows or columns that share a number.
    first : int
        Number that the first cell has; 0 but for codes that are centred.
    inverse : bool
    """

    kind: Literal["gray code"] = "gray code"
    axis: Axis
    bit: int = Field(ge=0)
    cell: int = Field(ge=1)
    first: int = Field(ge=0)
    inverse: bool

    @property
    def description(self) -> str:
        """The content in a few words."""
        inverse = ", inverse" if self.inverse else ""
        return f"Gray code of {self.axis}, bit {self.bit}{inverse}"


class Stripes(Content):
    """Dark and bright stripes of one width.

    Attributes
    ----------
    axis : {"rows", "columns"}
    width : int
    first : int
        Width of the first stripe that lies on the picture.
    is_first_white : bool
    """

    kind: Literal["stripes"] = "stripes"
    axis: Axis
    width: int = Field(ge=1)
    first: int = Field(ge=1)
    is_first_white: bool

    @property
    def description(self) -> str:
        """The content in a few words."""
        unit = self.axis if self.width > 1 else self.axis.removesuffix("s")
        return f"stripes {self.width} {unit} wide"


class Band(Content):
    """Neighbouring rows or columns that are bright and the others dark, or the reverse.

    Attributes
    ----------
    axis : {"rows", "columns"}
    start, stop : int
        The first of them, and the first after them.
    is_white : bool
        Whether they are bright.
    """

    kind: Literal["band"] = "band"
    axis: Axis
    start: int = Field(ge=0)
    stop: int = Field(ge=1)
    is_white: bool

    @property
    def description(self) -> str:
        """The content in a few words."""
        level, one = "white" if self.is_white else "black", self.axis.removesuffix("s")
        if self.stop - self.start == 1:
            return f"{level} {one} {self.start}"
        return f"{level} {self.axis} {self.start} to {self.stop - 1}"


class Code(Content):
    """Dark and bright rows or columns in no order that has a name here."""

    kind: Literal["code"] = "code"
    axis: Axis
    white_share: float

    @property
    def description(self) -> str:
        """The content in a few words."""
        return f"binary code of {self.axis}, {self.white_share:.0%} white"


class Block(Content):
    """A rectangle of pixels that is bright on dark, or the reverse.

    Attributes
    ----------
    top, left, height, width : int
    is_white : bool
        Whether the rectangle is bright.
    """

    kind: Literal["block"] = "block"
    top: int = Field(ge=0)
    left: int = Field(ge=0)
    height: int = Field(ge=1)
    width: int = Field(ge=1)
    is_white: bool

    @property
    def description(self) -> str:
        """The content in a few words."""
        level = "white" if self.is_white else "black"
        if self.height == self.width == 1:
            return f"{level} pixel ({self.top}, {self.left})"
        return f"{level} block of {self.height}x{self.width} at ({self.top}, {self.left})"


class Checkerboard(Content):
    """Dark and bright fields that alternate along rows and columns.

    Attributes
    ----------
    height, width : int
        Of a field.
    top, left : int or None
        Height and width of the first field that lies on the picture, where a shift cuts it off.
    is_first_white : bool
    """

    kind: Literal["checkerboard"] = "checkerboard"
    height: int = Field(ge=1)
    width: int = Field(ge=1)
    top: int | None = Field(default=None, ge=1)
    left: int | None = Field(default=None, ge=1)
    is_first_white: bool

    @property
    def description(self) -> str:
        """The content in a few words."""
        return f"checkerboard with fields of {self.height}x{self.width}"


class HadamardRow(Content):
    """A row of the Hadamard matrix of Sylvester's order, bright where it is 1.

    Attributes
    ----------
    row : int
        Its entry at pixel p, counted row by row, is (-1)^(number of bits that `row` and p share).
    inverse : bool
        Bright where it is -1.
    """

    kind: Literal["hadamard"] = "hadamard"
    row: int = Field(ge=0)
    inverse: bool

    @property
    def description(self) -> str:
        """The content in a few words."""
        return f"Hadamard row {self.row}{', inverse' if self.inverse else ''}"


class Binary(Content):
    """Two levels in no order that has a name here, such as random ones."""

    kind: Literal["binary"] = "binary"
    white_share: float

    @property
    def description(self) -> str:
        """The content in a few words."""
        return f"binary picture, {self.white_share:.0%} white"


class AnyPicture(Content):
    """A picture of no kind that is recognised."""

    kind: Literal["picture"] = "picture"
    is_colour: bool = False

    @property
    def description(self) -> str:
        """The content in a few words."""
        return "colour picture" if self.is_colour else "picture"


# A content as pydantic reads it from a file.
AnyContent = Annotated[
    Uniform
    | Fringes
    | GrayBit
    | Stripes
    | Band
    | Code
    | Block
    | Checkerboard
    | HadamardRow
    | Binary
    | AnyPicture,
    Field(discriminator="kind"),
]
