"""Whether light adds up: two patterns that sum to white give the light of white together.

Index convention: patterns are (Py, Px), photos (Cy, Cx, channels) in raw levels.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Size
from nearfar.faults.records import Fault, LightDoesNotAdd
from nearfar.rigs.base import Photo
from nearfar.rigs.real.black_and_white import BlackAndWhite

# Sums that miss white by more than this share are a fault.
MAXIMUM_EXCESS_SHARE = 0.02


class Superposition(NamedTuple):
    """The result of a superposition check.

    Attributes
    ----------
    faults : tuple of Fault
    left, right : array
        Photos of the left half of white and of the right, the last two that were taken.
    """

    faults: tuple[Fault, ...]
    left: Photo
    right: Photo


def halves(projector: Size) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return patterns of the left half of white and of the right."""
    left = np.zeros(projector, dtype=np.uint8)
    left[:, : projector.width // 2] = 255
    return left, 255 - left


def check_superposition(
    photograph: Callable[[NDArray[np.uint8]], Photo],
    projector: Size,
    levels: BlackAndWhite,
    *,
    is_calibrated: bool,
) -> Superposition:
    """Photograph two pairs of patterns that sum to white: two greys, and two halves.

    Greys miss white where the response is not linear, halves where the projector's picture
    depends on all of it.

    Parameters
    ----------
    photograph : callable
        Photographs an 8-bit pattern.
    projector : Size
        Pattern grid.
    levels : BlackAndWhite
    is_calibrated : bool
        Whether the projector's response has been calibrated, for the cure.
    """
    grey = np.full(projector, 127, dtype=np.uint8)
    pairs = {
        "127 and 128 of 255": (grey, 255 - grey),
        "the left half and the right": halves(projector),
    }
    black = float(levels.black.mean())
    faults: list[Fault] = []
    for name, patterns in pairs.items():
        photos = [photograph(pattern) for pattern in patterns]
        light = sum(float(photo.mean(dtype=np.float64)) - black for photo in photos)
        excess = light / levels.contrast - 1
        if abs(excess) > MAXIMUM_EXCESS_SHARE:
            faults.append(LightDoesNotAdd(name, 1 + excess, is_calibrated))
    left, right = photos
    return Superposition(tuple(faults), left, right)
