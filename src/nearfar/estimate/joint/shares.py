"""How much of each hat about q lies on the projector.

A hat's share is a product of its shares along both axes, each of which is the difference of two
entries of a table of its sums.

Index convention: c runs over camera pixels, j over hats, u over hats that differ along an axis.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Integers, Size, blocks
from nearfar.compiled import compiled
from nearfar.parallel import side_by_side

# Camera pixels of a batch.
BATCH_PIXELS = 4096


class _Hats(NamedTuple):
    """Hats along one axis.

    Attributes
    ----------
    first : ndarray of int, shape (U,)
        Offset of the first projector pixel that each that differs touches, from the rounded q.
    sums : ndarray, shape (U, L), float64
        Of each, over the pixels before the first, before the next, ...; 1 at the end.
    hat : ndarray of int, shape (J,)
        The one of each function.
    """

    first: Integers
    sums: Floats
    hat: Integers


def share_on_projector(
    centres: NDArray[np.int64], offsets: Integers, pitches: Integers, projector: Size
) -> Floats:
    """Return the share of each hat about q that lies on the projector, float32.

    Parameters
    ----------
    centres : ndarray of int, shape (C, 2)
    offsets : ndarray of int, shape (J, 2)
    pitches : ndarray of int, shape (J,)
    projector : Size

    Returns
    -------
    ndarray, shape (C, J), float32
    """
    found = np.empty((len(centres), len(offsets)), dtype=np.float32)
    down, across = (_hats(offsets[:, axis], pitches) for axis in (0, 1))
    last = np.array(projector) - 1

    def work(batch: slice) -> None:
        _write_shares(found[batch], centres[batch], last, *down, *across)

    side_by_side(work, blocks(len(centres), BATCH_PIXELS))
    return found


def _hats(offsets: Integers, pitches: Integers) -> _Hats:
    both = np.stack([offsets, pitches], axis=1)
    places, hat = np.unique(both, axis=0, return_inverse=True)
    sums = np.ones((len(places), 2 * int(pitches.max(initial=0)) + 2))
    for row, pitch in zip(sums, places[:, 1].tolist(), strict=True):
        side = np.arange(-pitch, pitch + 1)
        row[0] = 0.0
        row[1 : len(side) + 1] = np.cumsum(np.maximum(0.0, 1.0 - np.abs(side) / pitch) / pitch)
    return _Hats(places[:, 0] - places[:, 1], sums, hat.ravel())


@compiled
def _along_axis(above: int, below: int, first: Integers, sums: Floats, found: Floats) -> None:
    """Write the share of each hat on pixels from `above` before q to `below` after it, (U,)."""
    for u in range(len(first)):
        before = min(max(-above - first[u], 0), sums.shape[1] - 1)
        until = min(max(below + 1 - first[u], 0), sums.shape[1] - 1)
        found[u] = max(sums[u, until] - sums[u, before], 0.0)


@compiled
def _write_shares(
    found: Floats,
    centres: Integers,
    last: Integers,
    first_down: Integers,
    sums_down: Floats,
    hat_down: Integers,
    first_across: Integers,
    sums_across: Floats,
    hat_across: Integers,
) -> None:
    down, across = np.empty(len(first_down)), np.empty(len(first_across))
    for c in range(len(centres)):
        y, x = centres[c, 0], centres[c, 1]
        _along_axis(y, last[0] - y, first_down, sums_down, down)
        _along_axis(x, last[1] - x, first_across, sums_across, across)
        for j in range(len(hat_down)):
            found[c, j] = down[hat_down[j]] * across[hat_across[j]]
