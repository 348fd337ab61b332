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
# The same where they are summed: all projector pixels are gone through once for each batch.
BATCH_PIXELS_BACK = 2**16


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
    """Where both boxes of footprints read a summed-area table: four rows times four columns.

    Attributes
    ----------
    rows, columns : ndarray of int16 or int32, shape (2, C, 4)
        Of each box.
    of_rows, of_columns : ndarray of float64, shape (2, C, 4)
        Their weights, half of each box's light; 0 without direct light.
    """

    rows: Integers
    columns: Integers
    of_rows: Floats
    of_columns: Floats

    def of(self, some: slice | Integers) -> "BoxAxes":
        """Return those of some camera pixels."""
        rows, columns, of_rows, of_columns = self
        return BoxAxes(rows[:, some], columns[:, some], of_rows[:, some], of_columns[:, some])

    def places(self, projector: Size) -> Footprint:
        """Return flat places and weights, both (C, 32)."""
        rows, columns = self.rows[..., :, None].astype(np.int64), self.columns[..., None, :]
        flat = rows * (projector.width + 1) + columns
        weights: Any = self.of_rows[..., :, None] * self.of_columns[..., None, :]
        shape = (self.rows.shape[1], 32)
        flat, weights = (np.moveaxis(v, 0, 1).reshape(shape) for v in (flat, weights))
        return Footprint(flat, weights)

    def means(self, table: Floats, projector: Size) -> Floats:
        """Return the footprints' mean light, shape (C,), from a flat summed-area table."""
        total = np.zeros(self.rows.shape[1])
        for rows, columns, of_rows, of_columns in zip(*self, strict=True):
            flat = (rows * np.int64(projector.width + 1))[:, :, None] + columns[:, None]
            along = np.take(table, flat) @ of_columns[:, :, None]
            total += np.einsum("cy,cy->c", along[..., 0], of_rows)
        return total

    def shares(self, c: int) -> tuple[tuple[slice, slice], Floats]:
        """Return the projector rows and columns that one footprint touches, and its shares.

        Returns
        -------
        sides : tuple of slice
        shares : ndarray, shape (rows, columns)
            Of each projector pixel.
        """
        sides, along = [], []
        of_axes = (
            (self.rows[:, c], self.of_rows[:, c]),
            (self.columns[:, c], self.of_columns[:, c]),
        )
        for corners, weights in of_axes:
            first, last = int(corners.min()), int(corners.max())
            # A corner's sum holds all pixels before it.
            before = np.arange(first, last)[None, :, None] < corners[:, None]
            along.append((before @ weights[..., None])[..., 0])
            sides.append(slice(first, last))
        return (sides[0], sides[1]), along[0].T @ along[1]


def boxes_adjoint(image: Floats, where: BoxAxes, projector: Size) -> Floats:
    """Adjoint of `BoxAxes.means`: spread an image (C,) over footprints, (Py, Px), float64."""
    table = np.zeros((projector.height + 1) * (projector.width + 1))
    lit = np.flatnonzero(where.of_rows.any(axis=(0, 2)) & (image != 0))
    for some in blocks(len(lit), BATCH_PIXELS_BACK):
        here = where.of(lit[some]).places(projector)
        shares = here.weights * np.asarray(image, dtype=np.float64)[lit[some], None]
        table += np.bincount(here.pixels.ravel(), shares.ravel(), len(table))
    return spread_summed_area(table, projector)


def box_axes(correspondence: Floats, footprints: Floats, projector: Size) -> BoxAxes:
    """Return the rows and columns of a summed-area table that boxes read; see `box_places`."""
    q = np.asarray(correspondence).reshape(-1, 2)
    numbers = np.asarray(footprints).reshape(-1, 4)
    shape = (2, len(q), 4)
    # A full HD projector's take half the memory.
    kind = np.int16 if max(projector) <= np.iinfo(np.int16).max else np.int32
    places = np.empty((2, *shape), dtype=kind)
    weights = np.empty((2, *shape))

    def work(batch: slice) -> None:
        lit: Booleans = np.asarray(np.isfinite(q[batch]).all(axis=1))
        middles, sides = halves(np.where(lit[:, None], q[batch], 0.0), numbers[batch])
        for axis, length in enumerate(projector):
            side = sides[:, axis]
            # Each of the two boxes has half of the light.
            half = 0.5 * lit if axis == 0 else lit
            for end, sign in enumerate((-1.0, 1.0)):
                # Corners of pixels lie half a pixel before their middles.
                corner = np.clip(middles[..., axis] + 0.5 + 0.5 * sign * side, 0, length)
                low = np.minimum(np.floor(corner), length - 1)
                part, scale = corner - low, sign * half / side
                for step, share in enumerate((1 - part, part)):
                    places[axis, :, batch, 2 * end + step] = low + step
                    weights[axis, :, batch, 2 * end + step] = scale * share

    side_by_side(work, blocks(len(q), BATCH_PIXELS))
    return BoxAxes(places[0], places[1], weights[0], weights[1])


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
    return box_axes(correspondence, footprints, projector).places(projector)


def box_weights(correspondence: Floats, centres: Integers, footprints: Floats) -> Floats:
    """Return the shares that footprints have of the projector pixels about a place.

    Parameters
    ----------
    correspondence : ndarray, shape (n, 2)
        q.
    centres : ndarray of int, shape (n, 2)
        The places.
    footprints : ndarray, shape (n, 4)
        Some of a footprint may lie beyond these pixels.

    Returns
    -------
    ndarray, shape (n, 9)
        Of the 3 x 3 pixels about each place, row by row, as those of
        `nearfar.transport.direct.direct_weights`.
    """
    middles, sides = halves(correspondence, footprints)
    shares = np.zeros((len(sides), 3, 3))
    for offsets in middles - centres:
        down, across = (box_overlaps(offsets[:, i], sides[:, i], reach=1) for i in range(2))
        shares += 0.5 * down[:, :, None] * across[:, None, :]
    return shares.reshape(-1, 9)


def blurred_boxes(footprints: Floats, width: Floats | float) -> Floats:
    """Return footprints (C, 4) whose boxes are blurred by boxes of a width, or of widths (C, 1)."""
    found = footprints.copy()
    found[:, :2] = np.hypot(found[:, :2], width)
    return found


def halves(correspondence: Floats, footprints: Floats) -> tuple[Floats, Floats]:
    """Return the middles of both boxes of footprints, (2, C, 2), and their sides, (C, 2)."""
    q = np.asarray(correspondence, dtype=np.float64).reshape(-1, 2)
    numbers = np.asarray(footprints, dtype=np.float64).reshape(-1, 4)
    sides = np.maximum(numbers[:, :2], LEAST_WIDTH)
    return np.stack([q - numbers[:, 2:], q + numbers[:, 2:]]), sides


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
    edges = np.arange(-reach, reach + 2, dtype=offsets.dtype) - offsets.dtype.type(0.5)
    scale = (1.0 / np.maximum(widths, LEAST_WIDTH)).astype(offsets.dtype)
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
