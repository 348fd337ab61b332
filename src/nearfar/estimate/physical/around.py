"""Values of the camera pixels around each camera pixel."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Integers

Number = TypeVar("Number", bound=np.generic)


def steps(reach: int) -> Integers:
    """Return the steps (y, x) to the camera pixels up to a reach on each side, itself left out."""
    side = np.arange(-reach, reach + 1)
    every = np.stack(np.meshgrid(side, side, indexing="ij"), axis=-1).reshape(-1, 2)
    return np.asarray(every[np.any(every != 0, axis=1)])


def moved(picture: NDArray[Number], step: Integers, beyond: float) -> NDArray[Number]:
    """Return for each camera pixel the value that is a step (y, x) away; `beyond` at the border."""
    height, width = picture.shape[:2]
    found = np.full_like(picture, beyond)
    down, across = (int(part) for part in step)
    to = slice(max(0, -down), height - max(0, down)), slice(max(0, -across), width - max(0, across))
    at = slice(max(0, down), height - max(0, -down)), slice(max(0, across), width - max(0, -across))
    found[to] = picture[at]
    return found


def neighbours(picture: Floats) -> Floats:
    """Return the eight values next to each camera pixel, shape (8, Cy, Cx, ...).

    Beyond the border, and where one is NaN, stands the camera pixel's own.
    """
    found = np.stack([moved(picture, step, np.nan) for step in steps(1)])
    return np.where(np.isnan(found), picture, found)
