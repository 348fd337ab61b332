"""Cells of the projector about q, in which light under a surface is compared.

A cell is a square of projector pixels: a quarter as wide as the coarsest functions of near-range
light are apart, a single pixel where these are. Farther from q, where kernels are smooth, several
cells count as one.

Index convention: c runs over camera pixels, o over `offsets`, g over groups of cells.
"""

from functools import lru_cache

import numpy as np

from nearfar.arrays import Complexes, Floats, Integers
from nearfar.compiled import compiled
from nearfar.illumination.near_basis import window_offsets
from nearfar.transport.boxes import summed_area
from nearfar.transport.model import Transport

# Cells from q up to which light under a surface is compared with responses.
REACH = 12
# Cells from q up to which each counts by itself.
SINGLE_REACH = 4
# Cells along each side of a group: along an axis on which it lies farther from q than those, and
# along one on which it does not. The latter divides 2 SINGLE_REACH + 1.
FAR_SIDE, BESIDE_SIDE = 2, 3


def cell_side(transport: Transport) -> int:
    """Return the projector pixels along each side of a cell."""
    return max(1, transport.pitch // 4)


def camera_pixels_to_a_cell(transport: Transport) -> int:
    """Return how many camera pixels see a cell along each side, at least 1."""
    lit = transport.lit
    extent = np.prod(np.ptp(transport.correspondence[lit], axis=0) / cell_side(transport) + 1.0)
    return max(1, int(np.ceil(np.sqrt(lit.sum() / extent) - 0.25)))


def offsets() -> Integers:
    """Return the offsets (y, x) of cells from q, shape (O, 2)."""
    return window_offsets(2 * REACH + 1)


@lru_cache(maxsize=1)
def groups() -> Integers:
    """Return the group of each cell at `offsets`, shape (O,), from 0 without a gap."""
    along = np.arange(-REACH, REACH + 1)
    # Parts of an axis, from -1 to 1 beside q and on from there on either side.
    beside = (along + SINGLE_REACH) // BESIDE_SIDE - SINGLE_REACH // BESIDE_SIDE
    last = (2 * SINGLE_REACH) // BESIDE_SIDE - SINGLE_REACH // BESIDE_SIDE
    far = np.sign(along) * (last + 1 + (np.abs(along) - SINGLE_REACH - 1) // FAR_SIDE)
    part = np.where(np.abs(along) > SINGLE_REACH, far, beside)
    down, across = offsets().T
    is_single = np.maximum(np.abs(down), np.abs(across)) <= SINGLE_REACH
    of_several = len(along) * part[down + REACH] + part[across + REACH]
    numbers = np.where(is_single, np.arange(len(down)), -len(down) + of_several)
    found = np.unique(numbers, return_inverse=True)[1].ravel()
    found.flags.writeable = False
    return found


@lru_cache(maxsize=1)
def _by_groups() -> tuple[Integers, Integers]:
    """Return offsets in the order of their groups, (O,), and where groups begin, (G + 1,)."""
    order = np.argsort(groups(), kind="stable")
    return order, np.searchsorted(groups()[order], np.arange(groups().max() + 2))


def summed(weights: Floats, values: Complexes) -> Complexes:
    """Return sums over the groups of weighted values.

    Parameters
    ----------
    weights : ndarray, shape (O,)
    values : ndarray, shape (O, K)

    Returns
    -------
    ndarray, shape (G, K)
    """
    order, bounds = _by_groups()
    sums = np.zeros((len(bounds) - 1, values.shape[1]), dtype=values.dtype)
    # Real numbers alone: half the work of complex ones.
    _add_weighted(weights, values.view(np.float64), order, bounds, sums.view(np.float64))
    return sums


@compiled
def _add_weighted(
    weights: Floats, values: Floats, order: Integers, bounds: Integers, sums: Floats
) -> None:
    for group in range(len(sums)):
        of_group = sums[group]
        for place in range(bounds[group], bounds[group + 1]):
            weight, row = weights[order[place]], values[order[place]]
            for k in range(len(row)):
                of_group[k] += weight * row[k]


def covered(coverage: Floats, rounded: Integers, side: int) -> Floats:
    """Return the mean coverage of groups of cells about rounded q, shape (n, G), float64.

    Parameters
    ----------
    coverage : ndarray, shape (Py, Px)
        Share of each projector pixel that lights a body; what lies beyond the border lights none.
    rounded : ndarray of int, shape (n, 2)
    side : int
        Projector pixels along each side of a cell.
    """
    of_cells = np.pad(_means(coverage, side), REACH)
    table = summed_area(of_cells).reshape(np.array(of_cells.shape) + 1)
    cell = rounded // side + REACH
    count = groups().max() + 1
    found = np.empty((len(rounded), count))
    for group in range(count):
        mine = offsets()[groups() == group]
        # Groups are rectangles.
        top, left = (cell + mine.min(axis=0)).T
        bottom, right = (cell + mine.max(axis=0) + 1).T
        total = table[bottom, right] - table[top, right] - table[bottom, left] + table[top, left]
        found[:, group] = total / len(mine)
    return found


def _means(picture: Floats, side: int) -> Floats:
    """Return means over cells; at the border, over as much of a cell as there is."""
    height, width = (-(-length // side) for length in picture.shape)
    down, across = (
        np.arange(length) // side == np.arange(cells)[:, None]
        for length, cells in zip(picture.shape, (height, width), strict=True)
    )
    sums = down @ picture @ across.T
    return np.asarray(sums / np.outer(down.sum(axis=1), across.sum(axis=1)))
