"""Finding how long after the display of a frame its photo shows it, and it alone."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.errors import DeviceError
from nearfar.rigs.base import Photo
from nearfar.rigs.real.black_and_white import (
    BlackAndWhite,
    agree_in_mean,
    measure_black_and_white,
)

# Any projector and camera have settled after this many refreshes.
MAXIMUM_SETTLE_REFRESHES = 32


class Synchronised(NamedTuple):
    """The result of synchronising.

    Attributes
    ----------
    settle : int
        Refreshes from the display of a frame to the exposure.
    levels : BlackAndWhite
    """

    settle: int
    levels: BlackAndWhite


def synchronise(
    photograph: Callable[[NDArray[np.uint8], int], Photo],
    black: NDArray[np.uint8],
    white: NDArray[np.uint8],
    settle: int,
) -> Synchronised:
    """Find the settle time, by photos of white soon after black and long after it.

    Parameters
    ----------
    photograph : callable
        Takes a frame and the refreshes to wait after its display.
    black, white : array
        Frames.
    settle : int
        Refreshes to begin with; doubled until photos follow the frames.

    Raises
    ------
    DeviceError
        If photos do not follow the frames, or white is no brighter than black.
    """
    while True:
        long = max(MAXIMUM_SETTLE_REFRESHES, settle)
        darks = [photograph(black, long)]
        soon = photograph(white, settle)
        lights = [photograph(white, long), photograph(white, settle)]
        darks.append(photograph(black, long))
        levels = measure_black_and_white(darks, lights)
        # A bad frame here would spoil all that follows.
        if agree_in_mean(darks, lights) and levels.is_same_light(soon, lights[0]):
            return Synchronised(settle, levels)
        if settle >= MAXIMUM_SETTLE_REFRESHES:
            raise DeviceError(
                f"photos do not follow the patterns even {MAXIMUM_SETTLE_REFRESHES} refreshes "
                f"after they are displayed, or the light varies by itself: turn the camera's "
                f"buffering, and what dims projector or room, off."
            )
        settle = max(1, 2 * settle)
