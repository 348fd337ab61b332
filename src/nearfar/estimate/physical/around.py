"""Values of the camera pixels around each camera pixel, and how q moves from one to the next."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Integers
from nearfar.transport.model import Transport

Number = TypeVar("Number", bound=np.generic)

# Steps (y, x) to the next camera pixel in four directions; their opposites are the other four.
DIRECTIONS = np.array([(0, 1), (1, 0), (1, 1), (1, -1)])


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

    Beyond the border stand those on the other side of the camera pixel, as the camera pixel itself
    would be among those that it is compared with. Where one is NaN stands the camera pixel's own.
    """
    height, width = picture.shape[:2]
    rest = [(0, 0)] * (picture.ndim - 2)
    around = np.pad(picture, [(1, 1), (1, 1), *rest], mode="reflect")
    found = np.stack([around[y : y + height, x : x + width] for y, x in steps(1) + 1])
    return np.where(np.isnan(found), picture, found)


def steps_of_q(transport: Transport) -> NDArray[np.float64]:
    """Return by how much q moves from one camera pixel to the next, in the median.

    Parameters
    ----------
    transport : Transport

    Returns
    -------
    ndarray, shape (2, 2), float64
        Projector pixels (y, x): a row for a step down and one for a step across; 0 where nothing is
        known.
    """
    q = np.where(transport.lit[..., None], transport.correspondence, np.nan)
    apart = [np.diff(q, axis=axis).reshape(-1, 2) for axis in (0, 1)]
    known = [one[np.isfinite(one).all(axis=1)] for one in apart]
    return np.stack([np.median(one, axis=0) if len(one) else np.zeros(2) for one in known])


def longest_step_of_q(transport: Transport) -> float:
    """Return the larger distance, along an axis, of a step of q: at least 1 projector pixel.

    Parameters
    ----------
    transport : Transport
    """
    return max(1.0, float(np.abs(steps_of_q(transport)).max()))
