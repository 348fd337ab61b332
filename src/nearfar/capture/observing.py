"""The interface of observers, which follow a capture photo by photo and may end it."""

from collections.abc import Callable, Sequence
from enum import Enum
from typing import Any, Protocol

from numpy.typing import NDArray

from nearfar.deprecation import warn_of


class Decision(Enum):
    """Whether a capture is to go on."""

    CONTINUE = "continue"
    ENOUGH = "enough"


class CaptureObserver(Protocol):
    """Is called with every photo of a capture, in order."""

    def after_photo(self, number: int, photo: NDArray[Any]) -> Decision | None:
        """Take in a photo.

        Parameters
        ----------
        number : int
            Its number in the plan.
        photo : array, shape (Cy, Cx, channels)
            Raw levels. It is on the disk already.

        Returns
        -------
        Decision or None
            ``Decision.ENOUGH`` ends the capture with this photo; an observer that never ends one
            returns None.
        """
        ...


def is_enough(observers: Sequence[CaptureObserver], number: int, photo: NDArray[Any]) -> bool:
    """Pass a photo to every observer; return whether any of them ends the capture."""
    decisions = [observer.after_photo(number, photo) for observer in observers]
    return Decision.ENOUGH in decisions


class _Predicate:
    """An observer that ends a capture where a function returns true."""

    def __init__(self, predicate: Callable[[int, NDArray[Any]], bool]) -> None:
        self._predicate = predicate

    def after_photo(self, number: int, photo: NDArray[Any]) -> Decision:
        return Decision.ENOUGH if self._predicate(number, photo) else Decision.CONTINUE


def with_predicate(
    observers: Sequence[CaptureObserver],
    enough: Callable[[int, NDArray[Any]], bool] | None,
    function: str,
    *,
    stacklevel: int = 4,
) -> Sequence[CaptureObserver]:
    """Add a predicate, given as the deprecated `enough`, to the observers; warn of it.

    Parameters
    ----------
    observers : sequence of CaptureObserver
    enough : callable, optional
        Returns whether the capture ends with a photo, by its number and the photo.
    function : str
        The public function that it was given to.
    stacklevel : int
        As `warnings.warn` takes it; 4 is the caller of the function that calls this one.
    """
    if enough is None:
        return observers
    warn_of(
        f"enough of {function}",
        "give observers, whose method after_photo returns a nearfar.capture.Decision",
        stacklevel=stacklevel,
    )
    return [*observers, _Predicate(enough)]
