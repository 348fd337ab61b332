"""The common attributes of measured and exact transports with separate components."""

from typing import Protocol

from nearfar.arrays import Floats, Size


class Apart(Protocol):
    """A transport whose components are known separately."""

    @property
    def projector(self) -> Size:
        """Pattern grid."""
        ...

    @property
    def camera(self) -> Size:
        """Height and width of the photos."""
        ...

    @property
    def correspondence(self) -> Floats:
        """q, shape (Cy, Cx, 2); NaN without direct light."""
        ...

    def component_rows(self, pixels: slice) -> tuple[Floats, Floats, Floats]:
        """Dense rows of D, N and F, each (n, channels, P)."""
        ...
