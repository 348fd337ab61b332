"""Direct light of a box of projector pixels: what a camera pixel sees of a fine projector.

The part of the projector that lights a camera pixel is a parallelogram, whose sides are how far q
moves from one camera pixel to the next. A box of the same spread along each axis stands for it. A
projector pixel counts by the share of the box that it covers. Sums over boxes of any size are four
values of a summed-area table (Crow, SIGGRAPH 1984), each interpolated between four entries.

Index convention: c runs over camera pixels, row by row.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Size
from nearfar.transport.direct import Footprint

# Narrower boxes are as good as points.
LEAST_WIDTH = 1e-3


def summed_area(light: Floats) -> Floats:
    """Return the sums of a light (Py, Px) up to each corner of a pixel, flat, float64."""
    table = np.zeros((light.shape[0] + 1, light.shape[1] + 1))
    np.cumsum(light, axis=0, out=table[1:, 1:], dtype=np.float64)
    np.cumsum(table[1:, 1:], axis=1, out=table[1:, 1:])
    return table.reshape(-1)


def spread_summed_area(table: NDArray[Any], projector: Size) -> Floats:
    """Adjoint of `summed_area`: flat to (Py, Px)."""
    square = table.reshape(projector.height + 1, projector.width + 1)[1:, 1:]
    backwards = np.cumsum(np.cumsum(square[::-1, ::-1], axis=0), axis=1)
    return np.asarray(backwards[::-1, ::-1])


def box_places(correspondence: Floats, widths: Floats, projector: Size) -> Footprint:
    """Return the entries of a summed-area table whose weighted sum is a box's mean light.

    Parameters
    ----------
    correspondence : ndarray, shape (..., 2)
        q, the middle of each box; NaN where there is no direct light, which gets weights of 0.
    widths : ndarray, shape (..., 2)
        Height and width of each box, projector pixels. What lies beyond the projector is dark.
    projector : Size

    Returns
    -------
    Footprint
        Places and weights, both (C, 16).
    """
    q = np.asarray(correspondence, dtype=np.float64).reshape(-1, 2)
    lit: Booleans = np.asarray(np.isfinite(q).all(axis=1))
    q = np.where(lit[:, None], q, 0.0)
    sides = np.maximum(np.asarray(widths, dtype=np.float64).reshape(-1, 2), LEAST_WIDTH)
    entries, shares = [], []
    for axis, side in enumerate(projector):
        # Corners of pixels lie half a pixel before their middles.
        ends = q[:, axis, None] + 0.5 + sides[:, axis, None] * np.array([-0.5, 0.5])
        ends = np.clip(ends, 0, side)
        low = np.minimum(np.floor(ends), side - 1).astype(np.int64)
        part = ends - low
        signs = np.array([-1.0, 1.0]) / sides[:, axis, None]
        entries.append(np.stack([low, low + 1], axis=-1).reshape(-1, 4))
        shares.append(np.stack([signs * (1 - part), signs * part], axis=-1).reshape(-1, 4))
    flat = entries[0][:, :, None] * (projector.width + 1) + entries[1][:, None]
    weights = shares[0][:, :, None] * shares[1][:, None] * lit[:, None, None]
    return Footprint(flat.reshape(-1, 16), weights.reshape(-1, 16))


def box_overlaps(offsets: Floats, widths: Floats, reach: int) -> Floats:
    """Return the shares of boxes along one axis that lie in the pixels about q.

    Parameters
    ----------
    offsets, widths : ndarray, shape (n,)
        Middle of each box, from the rounded q, and its width.
    reach : int
        Of pixels to each side of the rounded q.

    Returns
    -------
    ndarray, shape (n, 2 reach + 1)
        Of the dtype of the offsets.
    """
    pixels = np.arange(-reach, reach + 1, dtype=offsets.dtype)
    half = 0.5 * np.maximum(widths, LEAST_WIDTH).astype(offsets.dtype)[:, None]
    high = np.minimum(offsets[:, None] + half, pixels + 0.5)
    low = np.maximum(offsets[:, None] - half, pixels - 0.5)
    high -= low
    return np.asarray(np.maximum(high, 0.0, out=high) / (2 * half))


def share_of_boxes(correspondence: Floats, widths: Floats, projector: Size) -> Floats:
    """Return the share of each box that lies on the projector, (C,); 0 without direct light."""
    q = np.asarray(correspondence, dtype=np.float64).reshape(-1, 2)
    half = 0.5 * np.maximum(np.asarray(widths, dtype=np.float64).reshape(-1, 2), LEAST_WIDTH)
    high = np.minimum(q + half, np.array(projector) - 0.5)
    low = np.maximum(q - half, -0.5)
    shares = np.prod(np.maximum(high - low, 0.0) / (2 * half), axis=1)
    return np.asarray(np.nan_to_num(shares, nan=0.0))
