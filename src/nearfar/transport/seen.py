"""What each camera pixel sees of a fine projector, from how far q moves between camera pixels.

Index convention: c runs over camera pixels, row by row.
"""

import numpy as np

from nearfar.arrays import Floats, blocks
from nearfar.compiled import compiled
from nearfar.parallel import side_by_side
from nearfar.transport.boxes import LEAST_WIDTH

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
# Centroids of camera pixels that are finer than projector pixels go in stairs: they stay in a pixel
# and leap to the next. Where q moves by less than this, in projector pixels, it is told over as
# many camera pixels to each side.
STAIR_MOVE, STAIR_REACH = 0.7, 3
# Rows of the camera on either side of a camera pixel that what it sees is told by.
SEEN_ROWS = MEDIAN_SIDE // 2 + STAIR_REACH
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
    q = np.ascontiguousarray(correspondence, dtype=np.float64)

    def work(axis: int) -> None:
        near, far = (_moves(q, axis, reach) for reach in (1, STAIR_REACH))
        longest = np.abs(far).max(axis=1)
        # 0 where all camera pixels that far away see other surfaces, or nothing.
        is_fine = (longest > 0) & (np.maximum(longest, np.abs(near).max(axis=1)) < STAIR_MOVE)
        moves[axis] = np.where(is_fine[:, None], far, near)

    side_by_side(work, (0, 1))
    found = np.empty((q.shape[0] * q.shape[1], 4), dtype=np.float32)
    _put_parallelograms(moves[0], moves[1], found)
    return found


@compiled
def _put_parallelograms(of_rows: Floats, of_columns: Floats, found: Floats) -> None:
    """Write the footprints whose sides are moves from row to row and column to column, (C, 4)."""
    for c in range(len(found)):
        slant, other_slant = (
            abs(of_rows[c, 0] * of_rows[c, 1]),
            abs(of_columns[c, 0] * of_columns[c, 1]),
        )
        halved, other = (of_rows, of_columns) if slant >= other_slant else (of_columns, of_rows)
        height = np.hypot(halved[c, 0], other[c, 0])
        width = np.hypot(halved[c, 1], other[c, 1])
        upright = max(slant, other_slant) <= LEAST_SLANT * (height * width)
        found[c, 0] = height if upright else np.hypot(0.5 * halved[c, 0], other[c, 0])
        found[c, 1] = width if upright else np.hypot(0.5 * halved[c, 1], other[c, 1])
        for axis in range(2):
            found[c, 2 + axis] = 0.0 if upright else 0.25 * halved[c, axis]


def _moves(q: Floats, axis: int, reach: int) -> Floats:
    """Return how far q (Cy, Cx, 2) moves along one axis of the camera, (C, 2), float64.

    By the camera pixels `reach` away on both sides.
    """
    known = np.empty((2, *q.shape[:2]))
    _put_moves(q, (reach, 0) if axis == 0 else (0, reach), known)
    return np.stack([_median(part) for part in known], axis=-1).reshape(-1, 2)


@compiled
def _put_moves(q: Floats, step: tuple[int, int], found: Floats) -> None:
    """Write the mean of the moves to both sides, or the smaller if one leads to another surface.

    Moves of as many camera pixels as a step has, over their number.
    """
    down, across = step
    scale = 1.0 / (down + across)
    for y in range(q.shape[0]):
        for x in range(q.shape[1]):
            after_y = after_x = before_y = before_x = 0.0
            after, before = np.inf, np.inf
            if y + down < q.shape[0] and x + across < q.shape[1]:
                after_y = q[y + down, x + across, 0] - q[y, x, 0]
                after_x = q[y + down, x + across, 1] - q[y, x, 1]
                # Not if either is NaN.
                if abs(after_y) <= LARGEST_MOVE and abs(after_x) <= LARGEST_MOVE:
                    after = max(abs(after_y), abs(after_x))
            if y >= down and x >= across:
                before_y = q[y, x, 0] - q[y - down, x - across, 0]
                before_x = q[y, x, 1] - q[y - down, x - across, 1]
                if abs(before_y) <= LARGEST_MOVE and abs(before_x) <= LARGEST_MOVE:
                    before = max(abs(before_y), abs(before_x))
            found[0, y, x], found[1, y, x] = 0.0, 0.0
            if min(after, before) == np.inf:
                continue
            if max(after, before) <= LARGEST_RATIO * min(after, before) + LARGEST_DIFFERENCE:
                found[0, y, x] = 0.5 * scale * (after_y + before_y)
                found[1, y, x] = 0.5 * scale * (after_x + before_x)
            elif after <= before:
                found[0, y, x], found[1, y, x] = scale * after_y, scale * after_x
            else:
                found[0, y, x], found[1, y, x] = scale * before_y, scale * before_x


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


def box_centres(correspondence: Floats, seen: Floats) -> Floats:
    """Return the middles of the footprints whose centroids on the pixels are q, (Cy, Cx, 2).

    The centroid of the shares of a box in whole pixels is not its middle: that of a box within one
    pixel is the pixel's.

    Parameters
    ----------
    correspondence : ndarray, shape (Cy, Cx, 2)
        q as correspondence finds it, a centroid.
    seen : ndarray, shape (C, 4)
        The footprints, as `seen_of_projector` tells them.
    """
    q = correspondence.reshape(-1, 2).astype(np.float64)
    footprints = seen.astype(np.float64)
    found = np.empty_like(q)
    side_by_side(
        lambda batch: _put_centres(q[batch], footprints[batch], found[batch]),
        blocks(len(q), BATCH_PIXELS),
    )
    return found.reshape(correspondence.shape)


@compiled
def _centroid(middle: float, width: float) -> float:
    """Return the centroid of a box's shares in whole pixels, along an axis."""
    low, high = middle - 0.5 * width, middle + 0.5 * width
    first, last = np.floor(low + 0.5), np.floor(high + 0.5)
    # Integrals of the rounded position from 0 to the box's ends.
    whole = last * (high - 0.5 * last) - first * (low - 0.5 * first)
    return float(whole / width)


@compiled
def _put_centres(q: Floats, footprints: Floats, found: Floats) -> None:
    """Write the middles of footprints (n, 4) with the centroids q (n, 2); NaN where these are."""
    for n in range(len(q)):
        for axis in range(2):
            rounded, skew = np.rint(q[n, axis]), footprints[n, 2 + axis]
            width = max(footprints[n, axis], LEAST_WIDTH)
            wanted = q[n, axis] - rounded
            middle = wanted
            for _ in range(CENTRE_STEPS):
                both = _centroid(middle - skew, width) + _centroid(middle + skew, width)
                # A centroid moves by at most 1 / width times as much as the middle.
                middle += (wanted - 0.5 * both) * min(width, 1.0)
            found[n, axis] = rounded + middle


def reach_of(footprints: Floats, margin: float = 0.0) -> int:
    """Return the projector pixels from the rounded q that footprints and a margin may touch."""
    largest = (0.5 * footprints[:, :2] + np.abs(footprints[:, 2:])).max(initial=0.0)
    return int(np.ceil(largest + 0.5 + margin)) + 1
