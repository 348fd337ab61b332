"""The adjoint of a transport as an operator: ``transport.H @ image``."""

from dataclasses import dataclass
from typing import ClassVar, Generic, Protocol, Self, TypeVar

from nearfar.arrays import Floats, Size
from nearfar.checks import NoArray


class HasAdjoint(Protocol):
    """A transport that sends images back to the projector."""

    @property
    def projector(self) -> Size:
        """Pattern grid."""
        ...

    @property
    def camera(self) -> Size:
        """Height and width of the photos."""
        ...

    def adjoint(self, image: Floats) -> Floats:
        """Send an image back."""
        ...

    def __mul__(self, factor: float) -> Self: ...


Of = TypeVar("Of", bound=HasAdjoint)


@dataclass(frozen=True, eq=False)
class AdjointTransport(NoArray, Generic[Of]):
    """T^T of a transport, per channel; make one by ``transport.H``.

    By Helmholtz reciprocity ``transport.H @ image`` is the dual photograph: the scene as the
    projector would see it, lit by `image` from the camera (Sen et al. 2005).

    Attributes
    ----------
    of : Transport or ExactTransport

    Examples
    --------
    >>> adjoint = transport.H
    >>> dual = adjoint @ relit
    >>> bool(np.isclose(np.vdot(transport @ light, relit), np.vdot(light, dual)))
    True
    >>> adjoint.H is transport
    True
    """

    of: Of
    _instead: ClassVar[str] = "multiply it with an image of the camera"

    @property
    def H(self) -> Of:  # noqa: N802
        """The transport itself."""
        return self.of

    def __matmul__(self, image: Floats) -> Floats:
        return self.of.adjoint(image)

    def __mul__(self, factor: float) -> "AdjointTransport[Of]":
        return AdjointTransport(self.of * factor)

    __rmul__ = __mul__
