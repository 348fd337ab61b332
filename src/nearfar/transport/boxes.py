"""Direct light of a box of projector pixels: what a camera pixel sees of a fine projector.

The part of the projector that lights a camera pixel is a parallelogram, whose sides are how far q
moves from one camera pixel to the next. A box of the same spread along each axis stands for it. A
projector pixel counts by the share of the box that it covers. Sums over boxes of any size are four
values of a summed-area table (Crow, SIGGRAPH 1984), each interpolated between four entries.

Index convention: c runs over camera pixels, row by row.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Integers, Size, blocks
from nearfar.parallel import side_by_side
from nearfar.transport.direct import Footprint

# Narrower boxes are as good as points.
LEAST_WIDTH = 1e-3
# Camera pixels of a batch.
BATCH_PIXELS = 4096


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


class BoxAxes(NamedTuple):
    """Where boxes read a summed-area table, an axis at a time: four rows times four columns.

    Attributes
    ----------
    rows, columns : ndarray of int32, shape (C, 4)
    of_rows, of_columns : ndarray of float64, shape (C, 4)
        Their weights; 0 without direct light.
    """

    rows: NDArray[np.int32]
    columns: NDArray[np.int32]
    of_rows: Floats
    of_columns: Floats

    def of(self, some: slice | Integers) -> "BoxAxes":
        """Return those of some camera pixels."""
        rows, columns, of_rows, of_columns = self
        return BoxAxes(rows[some], columns[some], of_rows[some], of_columns[some])

    def places(self, projector: Size) -> Footprint:
        """Return flat places and weights, both (C, 16)."""
        rows, columns = self.rows[:, :, None].astype(np.int64), self.columns[:, None]
        flat = rows * (projector.width + 1) + columns
        weights: Any = self.of_rows[:, :, None] * self.of_columns[:, None]
        return Footprint(flat.reshape(-1, 16), weights.reshape(-1, 16))

    def means(self, table: Floats, projector: Size) -> Floats:
        """Return the boxes' mean light, shape (C,), from a flat summed-area table."""
        flat = (self.rows * np.int64(projector.width + 1))[:, :, None] + self.columns[:, None]
        along = np.take(table, flat) @ self.of_columns[:, :, None]
        return np.asarray(np.einsum("cy,cy->c", along[..., 0], self.of_rows))

    def shares(self, c: int) -> tuple[tuple[slice, slice], Floats]:
        """Return the projector rows and columns that one box touches, and its share of each pixel.

        Returns
        -------
        sides : tuple of slice
        shares : ndarray, shape (rows, columns)
        """
        sides, along = [], []
        of_axes = ((self.rows[c], self.of_rows[c]), (self.columns[c], self.of_columns[c]))
        for corners, weights in of_axes:
            first, last = int(corners.min()), int(corners.max())
            # A corner's sum holds all pixels before it.
            along.append((np.arange(first, last)[:, None] < corners) @ weights)
            sides.append(slice(first, last))
        return (sides[0], sides[1]), np.outer(*along)


def box_axes(correspondence: Floats, widths: Floats, projector: Size) -> BoxAxes:
    """Return the rows and columns of a summed-area table that boxes read; see `box_places`."""
    q = np.asarray(correspondence).reshape(-1, 2)
    sides = np.asarray(widths).reshape(-1, 2)
    shape = (len(q), 4)
    places = np.empty((2, *shape), dtype=np.int32)
    weights = np.empty((2, *shape))

    def work(batch: slice) -> None:
        middles = np.asarray(q[batch], dtype=np.float64)
        lit: Booleans = np.asarray(np.isfinite(middles).all(axis=1))
        middles = np.where(lit[:, None], middles, 0.0)
        for axis, length in enumerate(projector):
            side = np.maximum(np.asarray(sides[batch, axis], dtype=np.float64), LEAST_WIDTH)
            for end, sign in enumerate((-1.0, 1.0)):
                # Corners of pixels lie half a pixel before their middles.
                corner = np.clip(middles[:, axis] + 0.5 + 0.5 * sign * side, 0, length)
                low = np.minimum(np.floor(corner), length - 1)
                part, scale = corner - low, sign * lit / side
                for step, share in enumerate((1 - part, part)):
                    places[axis, batch, 2 * end + step] = low + step
                    weights[axis, batch, 2 * end + step] = scale * share

    side_by_side(work, blocks(len(q), BATCH_PIXELS))
    return BoxAxes(places[0], places[1], weights[0], weights[1])


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
    return box_axes(correspondence, widths, projector).places(projector)


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
