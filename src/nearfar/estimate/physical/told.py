"""What the q of camera pixels on one side tell of the q of a camera pixel.

Near edges and creases q changes its course, so that only one side may go on to a camera pixel.
"""

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, blocks
from nearfar.compiled import compiled
from nearfar.estimate.physical.around import steps
from nearfar.parallel import side_by_side

# Camera pixels up to this distance tell; a side has those within this angle of its middle.
REACH = 6
HALF_ANGLE = np.pi / 4 + 0.01
SIDES = 8
# Fewer camera pixels of a side tell nothing.
LEAST_TELLING = 6
BATCH_PIXELS = 4096


def told_by_others(correspondence: Floats, telling: Booleans) -> tuple[Floats, Floats]:
    """Return the q that camera pixels on one side of each tell, by a plane through theirs.

    Of eight sides it is the one that tells q best.

    Parameters
    ----------
    correspondence : ndarray, shape (Cy, Cx, 2)
        q.
    telling : ndarray of bool, shape (Cy, Cx)
        Camera pixels whose q is known and may tell.

    Returns
    -------
    told : ndarray, shape (Cy, Cx, 2)
        NaN where no side tells anything.
    deviation : ndarray, shape (Cy, Cx)
        Its standard deviation, of the axis where it is larger: by how far the side's own q are from
        the plane. Infinite where no side tells anything.
    """
    q = np.where(telling[..., None], correspondence, 0.0).astype(np.float64)
    told, deviation = np.full(q.shape, np.nan), np.full(telling.shape, np.inf)
    sides = _sides()

    def work(batch: slice) -> None:
        _tell(q, telling, sides, batch.start, batch.stop, told, deviation)

    side_by_side(work, blocks(telling.size, BATCH_PIXELS))
    return told, deviation


def _sides() -> Integers:
    """Return the steps (y, x) to the camera pixels of each side, (8, n, 2), 0 where it ends."""
    every = steps(REACH)
    every = every[np.hypot(*every.T) <= REACH + 0.5]
    middles = 2 * np.pi / SIDES * np.arange(SIDES)
    off = np.abs((np.arctan2(*every.T) - middles[:, None] + np.pi) % (2 * np.pi) - np.pi)
    within = off <= HALF_ANGLE
    found = np.zeros((SIDES, within.sum(axis=1).max(), 2), dtype=np.int64)
    for side, chosen in zip(found, within, strict=True):
        side[: chosen.sum()] = every[chosen]
    return found


@compiled
def _tell(
    q: Floats,
    telling: Booleans,
    sides: Integers,
    first: int,
    last: int,
    told: Floats,
    deviation: Floats,
) -> None:
    """Write what the best side tells of camera pixels from first to last."""
    sums, of_q, squares = np.empty((3, 3)), np.empty((3, 2)), np.empty(2)
    inverse, reference = np.empty((3, 3)), np.empty(2)
    for c in range(first, last):
        y, x = divmod(c, telling.shape[1])
        for side in range(len(sides)):
            _sum(q, telling, (y, x), sides[side], reference, sums, of_q, squares)
            if sums[0, 0] < LEAST_TELLING or not _invert(sums, inverse):
                continue
            left = 0.0
            for axis in range(2):
                explained = 0.0
                for i in range(3):
                    for j in range(3):
                        explained += of_q[i, axis] * inverse[i, j] * of_q[j, axis]
                left = max(left, squares[axis] - explained)
            own = np.sqrt(left / (sums[0, 0] - 3.0) * inverse[0, 0])
            if own < deviation[y, x]:
                deviation[y, x] = own
                for axis in range(2):
                    told[y, x, axis] = reference[axis]
                    for j in range(3):
                        told[y, x, axis] += inverse[0, j] * of_q[j, axis]


@compiled
def _sum(
    q: Floats,
    telling: Booleans,
    place: tuple[int, int],
    side: Integers,
    reference: Floats,
    sums: Floats,
    of_q: Floats,
    squares: Floats,
) -> None:
    """Write the sums that a plane through the q of a side is fitted by.

    Those of the products of 1 and the steps down and across, with each other and with q, and those
    of q squared; q counts from the reference, one of the side's.
    """
    height, width = telling.shape
    terms = np.ones(3)
    sums[:], of_q[:], squares[:], reference[:] = 0.0, 0.0, 0.0, np.nan
    for n in range(len(side)):
        down, across = side[n, 0], side[n, 1]
        y, x = place[0] + down, place[1] + across
        inside = 0 <= y < height and 0 <= x < width and (down != 0 or across != 0)
        if not inside or not telling[y, x]:
            continue
        # Sums of squares of large numbers would lose small differences.
        if np.isnan(reference[0]):
            reference[:] = q[y, x]
        terms[1], terms[2] = down, across
        for i in range(3):
            for j in range(3):
                sums[i, j] += terms[i] * terms[j]
            for axis in range(2):
                of_q[i, axis] += terms[i] * (q[y, x, axis] - reference[axis])
        for axis in range(2):
            squares[axis] += (q[y, x, axis] - reference[axis]) ** 2


@compiled
def _invert(sums: Floats, inverse: Floats) -> bool:
    """Write the inverse of a symmetric 3 x 3 matrix of whole numbers; return whether it has one."""
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            c, d = (j + 1) % 3, (j + 2) % 3
            inverse[j, i] = sums[a, c] * sums[b, d] - sums[a, d] * sums[b, c]
    determinant = 0.0
    for j in range(3):
        determinant += sums[0, j] * inverse[j, 0]
    # Of whole numbers it is one, too: 0 where all camera pixels lie on a line.
    if determinant < 0.5:
        return False
    inverse /= determinant
    return True
