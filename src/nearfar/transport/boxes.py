"""Direct light of a few projector pixels: what a camera pixel sees of a fine projector.

The part of the projector that lights a camera pixel is a parallelogram about q, whose sides are how
far q moves from one camera pixel to the next. Halved across its more slanted side, it is two boxes
of the same spread along each axis, whose middles lie on either side of q. A projector pixel counts
by the share of the boxes that it covers. Sums over boxes of any size are four values of a
summed-area table (Crow, SIGGRAPH 1984), each interpolated between four entries.

A footprint is four numbers, in projector pixels: height and width of each box, and how far down and
across the middle of the second is from q; the first lies as far on the other side.

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


def box_places(correspondence: Floats, footprints: Floats, projector: Size) -> Footprint:
    """Return the entries of a summed-area table whose weighted sum is a footprint's mean light.

    Parameters
    ----------
    correspondence : ndarray, shape (..., 2)
        q; NaN where there is no direct light, which gets weights of 0.
    footprints : ndarray, shape (..., 4)
        What lies beyond the projector is dark.
    projector : Size

    Returns
    -------
    Footprint
        Places and weights, both (C, 32).
    """
    q = np.asarray(correspondence, dtype=np.float64).reshape(-1, 2)
    lit: Booleans = np.asarray(np.isfinite(q).all(axis=1))
    middles, sides = halves(np.where(lit[:, None], q, 0.0), footprints)
    both = [_places(of_half, sides, projector) for of_half in middles]
    weights = np.concatenate([own.weights for own in both], axis=1)
    weights *= 0.5 * lit[:, None]
    return Footprint(np.concatenate([own.pixels for own in both], axis=1), weights)


def halves(correspondence: Floats, footprints: Floats) -> tuple[Floats, Floats]:
    """Return the middles of both boxes of footprints, (2, C, 2), and their sides, (C, 2)."""
    q = np.asarray(correspondence, dtype=np.float64).reshape(-1, 2)
    numbers = np.asarray(footprints, dtype=np.float64).reshape(-1, 4)
    sides = np.maximum(numbers[:, :2], LEAST_WIDTH)
    return np.stack([q - numbers[:, 2:], q + numbers[:, 2:]]), sides


def _places(middles: Floats, sides: Floats, projector: Size) -> Footprint:
    """Return the entries of a summed-area table and their weights for boxes, both (C, 16)."""
    entries, shares = [], []
    for axis, length in enumerate(projector):
        # Corners of pixels lie half a pixel before their middles.
        ends = middles[:, axis, None] + 0.5 + sides[:, axis, None] * np.array([-0.5, 0.5])
        ends = np.clip(ends, 0, length)
        low = np.minimum(np.floor(ends), length - 1).astype(np.int64)
        part = ends - low
        signs = np.array([-1.0, 1.0]) / sides[:, axis, None]
        entries.append(np.stack([low, low + 1], axis=-1).reshape(-1, 4))
        shares.append(np.stack([signs * (1 - part), signs * part], axis=-1).reshape(-1, 4))
    flat = entries[0][:, :, None] * (projector.width + 1) + entries[1][:, None]
    weights = shares[0][:, :, None] * shares[1][:, None]
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
    """
    edges = np.arange(-reach, reach + 2) - 0.5
    scale = 1.0 / np.maximum(widths, LEAST_WIDTH)
    # Share of the box before each edge between two pixels.
    before = (edges - offsets[:, None]) * scale[:, None]
    before += 0.5
    return np.diff(np.clip(before, 0.0, 1.0, out=before), axis=1)


def share_of_boxes(correspondence: Floats, footprints: Floats, projector: Size) -> Floats:
    """Return the share of each footprint that lies on the projector, (C,); 0 without direct light.

    Parameters
    ----------
    correspondence, footprints, projector
        As `box_places` takes them.
    """
    middles, sides = halves(correspondence, footprints)
    high = np.minimum(middles + 0.5 * sides, np.array(projector) - 0.5)
    low = np.maximum(middles - 0.5 * sides, -0.5)
    shares = np.prod(np.maximum(high - low, 0.0) / sides, axis=2).mean(axis=0)
    return np.asarray(np.nan_to_num(shares, nan=0.0))
