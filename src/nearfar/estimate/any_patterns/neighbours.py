"""What is expected of a camera pixel from its neighbours: its black, n and F.

Photos of black are few and blacks are alike, so that neighbours tell more of black than the camera
pixel's own photos. Of n and F neighbours tell what light the photos' noise hides.

Index convention: arrays are (C, channels, ...), camera pixels row by row.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

from nearfar.arrays import Booleans, Floats, Integers, Size

# Side of the neighbourhood, and how far its farthest camera pixels lie. With 3 instead of 5,
# pictures lose up to 0.4 dB; a third sweep would gain 0.5 dB, for half as much time again.
SIDE = 5
REACH = SIDE // 2
STEPS = [step for step in np.ndindex(SIDE, SIDE) if step != (REACH, REACH)]


class Black(NamedTuple):
    """Black before a camera pixel's own photos.

    Attributes
    ----------
    mean, variance : ndarray, shape (C, channels), float64
    """

    mean: Floats
    variance: Floats


def expect_black(black: Floats, noise: Floats, camera: Size) -> Black:
    """Return the mean of the neighbours' blacks, and how far a camera pixel's is from it.

    Parameters
    ----------
    black : ndarray, shape (C, channels)
        Of camera pixels by their own photos.
    noise : ndarray, shape (C, channels)
        Standard deviation of a photo, and about that of black.
    camera : Size
    """
    shape = (*camera, -1)
    values = black.reshape(shape).astype(np.float64)
    # About their mean, squares of which would swallow the differences.
    offset = values.mean(axis=(0, 1))
    values -= offset
    squared_noise = noise.reshape(shape).astype(np.float64) ** 2
    count = _sum(np.ones((*camera, 1)))
    total = _sum(values)
    mean = total / count
    scatter = np.maximum(_sum(values**2) / count - mean**2, 0.0) * count / np.maximum(count - 1, 1)
    of_noise = _sum(squared_noise) / count
    others = np.maximum(count - 1, 1)
    variance = np.maximum(scatter - of_noise, 0.0) + of_noise / others
    expected = (total - values) / others + offset
    flat = black.shape
    return Black(expected.reshape(flat), np.maximum(variance, 1e-30).reshape(flat))


def _sum(values: Floats) -> Floats:
    """Return sums over the neighbourhood, (Cy, Cx, channels)."""
    return np.asarray(uniform_filter(values, (SIDE, SIDE, 1), mode="constant") * SIDE**2)


def adjacent(camera: Size) -> NDArray[np.int64]:
    """Return the neighbours of every camera pixel, (C, steps); -1 beyond the border."""
    numbers = np.pad(np.arange(camera.pixels).reshape(camera), REACH, constant_values=-1)
    found = [numbers[y : y + camera.height, x : x + camera.width].ravel() for y, x in STEPS]
    return np.stack(found, axis=1)


class ExpectedRows(NamedTuple):
    """n and F as the neighbours have them, scaled to a camera pixel's brightness.

    Attributes
    ----------
    near : ndarray, shape (n, channels, W^2)
    far : ndarray, shape (n, channels, R)
    """

    near: Floats
    far: Floats


def expect_rows(
    near: Floats,
    far: Floats,
    level: Floats,
    lit: Booleans,
    neighbours: Integers,
    pixels: NDArray[np.int64],
) -> ExpectedRows:
    """Return the mean of n and F of those neighbours that are lit directly as the pixel is, or not.

    Parameters
    ----------
    near, far : ndarray, shape (C, channels, ...)
    level : ndarray, shape (C, channels)
        Mean of a camera pixel's photos, above black.
    lit : ndarray of bool, shape (C,)
    neighbours : ndarray of int, shape (C, steps)
        As `adjacent` returns them.
    pixels : ndarray of int, shape (n,)
    """
    beside = neighbours[pixels]
    alike = (beside >= 0) & (lit[beside] == lit[pixels, None])
    count = np.maximum(alike.sum(axis=1), 1)
    # Rows are shares of the light that reaches the camera pixel.
    share = level[pixels, None] / level[beside] * (alike / count[:, None])[..., None]
    share = share.astype(np.float32)
    return ExpectedRows(
        np.einsum("nkc,nkcw->ncw", share, near[beside]),
        np.einsum("nkc,nkcr->ncr", share, far[beside]),
    )
