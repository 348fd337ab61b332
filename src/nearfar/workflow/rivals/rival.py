"""The interface of rival methods: their photos, their result, and their curve in a plot.

A rival of another package is a `Rival` too, added by an entry point of the group
``nearfar.rivals``.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from nearfar.arrays import Floats, Size

if TYPE_CHECKING:
    from nearfar.transport.known import KnownTransport
    from nearfar.workflow.rivals.bench import Bench


class Budget(NamedTuple):
    """Photos that a method may take, and the total exposure that they share.

    Attributes
    ----------
    photos : int
        At most.
    total_exposure : int, optional
        In units of one photo's at the camera's own setting. If left out, each photo is exposed
        for one unit.
    """

    photos: int
    total_exposure: int | None = None

    def exposure(self, photos: int) -> float:
        """Return the exposure of each photo, if `photos` are taken."""
        return 1.0 if self.total_exposure is None else self.total_exposure / photos


class Relights(Protocol):
    """A transport as far as relighting goes."""

    def __matmul__(self, light: Floats) -> Floats:
        """Return the picture under a light (Py, Px)."""
        ...


class Attempt(NamedTuple):
    """The result of a method.

    Attributes
    ----------
    photos : int
        All that were taken: those of stripes, inverses, references and black too.
    transport : Relights
        In photo units.
    exposure : float, optional
        Total, in units of one photo's at the camera's own setting. If left out, each photo was
        exposed for ``budget.exposure(photos)``.
    """

    photos: int
    transport: Relights
    exposure: float | None = None


@dataclass(frozen=True, kw_only=True)
class Rival:
    """A method of measuring light transport.

    Attributes
    ----------
    title : str
        What tables and plots call it.
    line : mapping
        Colour, marker and line style of its plot, as keyword arguments of
        `matplotlib.axes.Axes.plot`.
    attempts : callable
        From the bench and a budget to the attempts, of which the best on pictures counts; none
        where the budget is too small for the method. An attempt takes its photos with
        ``bench.rig(budget.exposure(photos))`` and finds correspondence itself. A method whose
        patterns depend on its photos asks for them one batch after the other, with
        ``bench.shooting(budget)``.
    assumes : str
        What it takes for granted of a scene or a rig, a phrase; empty if nothing.
    unsuited : callable, optional
        From the scene to a clause that says why the method cannot run on it, such as "needs ...",
        or None if it can.
    is_dense : bool
        Whether it holds each entry of T, or a photo of each projector pixel, so that it cannot run
        on scenes that are too large for matrices.
    photos : callable, optional
        From the pattern grid to the number of photos, for a method whose number is fixed. Left
        out for a method that adapts to a budget.
    """

    title: str
    line: Mapping[str, Any]
    attempts: "Callable[[Bench, Budget], Iterable[Attempt]]"
    assumes: str = ""
    unsuited: "Callable[[KnownTransport], str | None] | None" = None
    is_dense: bool = False
    photos: Callable[[Size], int] | None = None
