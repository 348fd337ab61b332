"""What each camera pixel sees of a fine projector, from how far q moves between camera pixels.

Index convention: c runs over camera pixels, row by row.
"""

import numpy as np

from nearfar.arrays import Floats, blocks
from nearfar.parallel import side_by_side
from nearfar.transport.boxes import halves

# q moves from one camera pixel to the next by the median over a square of this side.
MEDIAN_SIDE = 3
# Exchanges of two of nine values, the smaller to the first, after which the fifth is the median
# (Devillard, "Fast median search: an ANSI C implementation", 1998).
EXCHANGES = (
    *((1, 2), (4, 5), (7, 8), (0, 1), (3, 4), (6, 7), (1, 2), (4, 5), (7, 8), (0, 3)),
    *((5, 8), (4, 7), (3, 6), (1, 4), (2, 5), (4, 7), (4, 2), (6, 4), (4, 2)),
)
# A farther move, in projector pixels, leads to another surface.
LARGEST_MOVE = 24.0
# Moves to both sides stay on one surface if the larger is at most as many times the smaller, plus
# as many projector pixels.
LARGEST_RATIO, LARGEST_DIFFERENCE = 1.5, 0.5
# Parallelograms whose sides are less slanted, as a correlation of y and x, are taken as one box:
# half of it is narrower than a projector pixel sooner, and then tells little of q.
LEAST_SLANT = 0.1
# Steps by which the middles of footprints are found from their centroids.
CENTRE_STEPS = 12
BATCH_PIXELS = 4096


def seen_of_projector(correspondence: Floats) -> Floats:
    """Return the footprint that each camera pixel sees without blur, (C, 4), float32.

    It is the parallelogram whose sides are how far q moves from one camera pixel to the next, as
    `nearfar.transport.boxes` describes it.

    Parameters
    ----------
    correspondence : ndarray, shape (Cy, Cx, 2)
        q.
    """
    moves: list[Floats] = [np.empty(0), np.empty(0)]

    def work(axis: int) -> None:
        moves[axis] = _moves(correspondence, axis)

    side_by_side(work, (0, 1))
    of_rows, of_columns = moves
    slants = [np.abs(np.prod(side, axis=1)) for side in (of_rows, of_columns)]
    by_rows = (slants[0] >= slants[1])[:, None]
    halved, other = np.where(by_rows, of_rows, of_columns), np.where(by_rows, of_columns, of_rows)
    whole = np.hypot(halved, other)
    upright = np.abs(np.prod(halved, axis=1)) <= LEAST_SLANT * np.prod(whole, axis=1)
    found = np.concatenate([np.hypot(halved / 2, other), halved / 4], axis=1, dtype=np.float32)
    found[upright] = np.pad(whole[upright], ((0, 0), (0, 2)))
    return found


def _moves(correspondence: Floats, axis: int) -> Floats:
    """Return how far q moves along one axis of the camera, (C, 2)."""
    move = np.diff(correspondence.astype(np.float64), axis=axis)
    move[~(np.abs(move).max(axis=-1) <= LARGEST_MOVE)] = np.nan
    padding = [(0, 0)] * 3
    padding[axis] = (1, 1)
    padded = np.pad(move, padding, constant_values=np.nan)
    after, before = np.delete(padded, 0, axis=axis), np.delete(padded, -1, axis=axis)
    lengths = [np.nan_to_num(np.abs(one).max(axis=-1), nan=np.inf) for one in (after, before)]
    least, most = np.minimum(*lengths), np.maximum(*lengths)
    # The mean of the moves to both sides, or the smaller if one leads to another surface.
    alike = most <= LARGEST_RATIO * least + LARGEST_DIFFERENCE
    smaller = np.where((lengths[0] <= lengths[1])[..., None], after, before)
    known = np.nan_to_num(np.where(alike[..., None], (after + before) / 2, smaller), nan=0.0)
    parts = [_median(known[..., part]) for part in (0, 1)]
    return np.stack(parts, axis=-1).reshape(-1, 2)


def _median(values: Floats) -> Floats:
    """Return the median of 3 x 3 values, those at the border repeated beyond it."""
    padded = np.pad(values, 1, mode="edge")
    height, width = values.shape
    nine = [
        padded[down : down + height, across : across + width].copy()
        for down in range(MEDIAN_SIDE)
        for across in range(MEDIAN_SIDE)
    ]
    larger = np.empty_like(nine[0])
    for one, other in EXCHANGES:
        np.maximum(nine[one], nine[other], out=larger)
        np.minimum(nine[one], nine[other], out=nine[one])
        nine[other], larger = larger, nine[other]
    return nine[4]


def box_centres(correspondence: Floats) -> Floats:
    """Return the middles of the footprints whose centroids on the pixels are q, (Cy, Cx, 2).

    The centroid of the shares of a box in whole pixels is not its middle: that of a box within one
    pixel is the pixel's.

    Parameters
    ----------
    correspondence : ndarray, shape (Cy, Cx, 2)
        q as correspondence finds it, a centroid.
    """
    q = correspondence.reshape(-1, 2).astype(np.float64)
    footprints = seen_of_projector(correspondence)
    found = np.nan_to_num(q, nan=0.0)

    def work(batch: slice) -> None:
        rounded = np.rint(found[batch])
        wanted, its = found[batch] - rounded, footprints[batch]
        middles = wanted.copy()
        for _ in range(CENTRE_STEPS):
            both, widths = halves(middles, its)
            off = wanted - _centroids(both, widths).mean(axis=0)
            # A centroid moves by at most 1 / width times as much as the middle.
            middles += off * np.minimum(widths, 1.0)
        found[batch] = rounded + middles

    side_by_side(work, blocks(len(q), BATCH_PIXELS))
    return np.where(np.isnan(q), np.nan, found).reshape(correspondence.shape)


def _centroids(middles: Floats, widths: Floats) -> Floats:
    """Return the centroids of boxes' shares in whole pixels, along each axis."""
    ends = []
    for end in (middles - 0.5 * widths, middles + 0.5 * widths):
        pixel = np.floor(end + 0.5)
        # The integral of the rounded position from 0 to the box's end.
        ends.append(pixel * (end - 0.5 * pixel))
    return np.asarray((ends[1] - ends[0]) / widths)


def reach_of(footprints: Floats, margin: float = 0.0) -> int:
    """Return the projector pixels from the rounded q that footprints and a margin may touch."""
    largest = (0.5 * footprints[:, :2] + np.abs(footprints[:, 2:])).max(initial=0.0)
    return int(np.ceil(largest + 0.5 + margin)) + 1
