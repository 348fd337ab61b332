"""Responses of near-range light where the projector's border cuts hats of several projector pixels.

What is cut off a hat sends no light, so its responses depend on how far q is from the border.
Camera pixels share responses where their distances from the border are nearly the same.

Index convention: arrays are (n, channels, ...); r runs over real responses, j over functions.
"""

from collections.abc import Iterator
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Integers, Size, product_by_row
from nearfar.illumination.centred_basis import CentredBasis
from nearfar.illumination.near_basis import NearBasis


def is_cut(centres: NDArray[np.int64], near_basis: NearBasis, projector: Size) -> Booleans:
    """Return whether the border cuts functions about each rounded q, shape (C,)."""
    distances = border_distances(centres, near_basis, projector)
    return np.asarray((distances < near_basis.reach).any(axis=1))


def border_distances(
    centres: NDArray[np.int64], near_basis: NearBasis, projector: Size
) -> NDArray[np.int64]:
    """Return projector pixels from the rounded q to each border, at most the reach, (C, 4).

    Above, below, to the left and to the right, each rounded to one of those that `_rounded` lists.
    """
    last = np.array(projector) - 1 - centres
    distances = np.stack([centres[:, 0], last[:, 0], centres[:, 1], last[:, 1]], axis=1)
    return np.asarray(_rounded(near_basis.reach)[np.minimum(distances, near_basis.reach)])


@lru_cache(maxsize=16)
def _rounded(reach: int) -> NDArray[np.int64]:
    """Return the rounded distance for each distance from 0 to the reach.

    Distances are rounded to the nearest of 0, 1, 2, 3, 4, 6, 8, 12, ... and the reach. Near-range
    light fades with distance, so an error of a sixth far away does no more harm than half a pixel
    close by.
    """
    steps = [0, *(step for k in range(reach.bit_length()) for step in (2**k, 3 * 2**k // 2))]
    kept = np.array(sorted({step for step in steps if step < reach} | {reach}))
    return np.asarray(kept[np.abs(np.arange(reach + 1)[:, None] - kept).argmin(axis=1)])


def cut_alike(
    centres: NDArray[np.int64], centred: CentredBasis
) -> Iterator[tuple[Integers, tuple[int, int, int, int]]]:
    """Yield camera pixels whose functions are cut alike, and their distances from the border."""
    if not len(centres):
        return
    distances = border_distances(centres, centred.near_basis, centred.basis.projector)
    # Each four distances as one number.
    code = distances @ (centred.near_basis.reach + 1) ** np.arange(4)
    order = np.argsort(code, kind="stable")
    starts = _starts(code[order]).tolist()
    for start, stop in pairwise(starts):
        above, below, left, right = distances[order[start]].tolist()
        yield order[start:stop], (above, below, left, right)


def _starts(ordered: Integers | Floats) -> Integers:
    """Return where each value of an ordered array begins, and the array's length."""
    changes = np.flatnonzero(ordered[1:] != ordered[:-1]) + 1
    return np.concatenate([[0], changes, [len(ordered)]])


# Those of most cuts, for all sweeps and tiles.
@lru_cache(maxsize=512)
def _transposed(centred: CentredBasis, distances: tuple[int, int, int, int]) -> Floats:
    return np.ascontiguousarray(cut_responses(centred, distances).T, dtype=np.float32)


def cut_responses(centred: CentredBasis, distances: tuple[int, int, int, int]) -> Floats:
    """Return the responses of functions to the patterns, re-centred, as the border cuts them.

    Parameters
    ----------
    centred : CentredBasis
    distances : tuple of int
        Of the rounded q from the border: above, below, to the left and to the right.

    Returns
    -------
    ndarray, shape (R, J), float64
    """
    if min(distances) >= centred.near_basis.reach:
        return np.asarray(centred.on_window, dtype=np.float64)
    down, across = (
        _along_axis(centred, axis, *distances[2 * axis : 2 * axis + 2])[
            :, _axis_places(centred.near_basis, axis).function
        ]
        for axis in (0, 1)
    )
    whole = down * across
    found = whole.real[centred.basis.index]
    sines = centred.basis.is_sine
    found[sines] = whole.imag[centred.basis.index[sines]]
    return np.asarray(found)


class _AxisPlaces(NamedTuple):
    """Hats along one axis of the projector.

    Attributes
    ----------
    places : ndarray of int, shape (U, 2)
        Offset and pitch of each that differs.
    function : ndarray of int, shape (J,)
        The one of each function.
    """

    places: NDArray[np.int64]
    function: Integers


@lru_cache(maxsize=16)
def _axis_places(near_basis: NearBasis, axis: int) -> _AxisPlaces:
    both = np.stack([near_basis.offsets[:, axis], near_basis.pitches], axis=1)
    places, function = np.unique(both, axis=0, return_inverse=True)
    return _AxisPlaces(places, function.ravel())


@lru_cache(maxsize=1024)
def _along_axis(centred: CentredBasis, axis: int, above: int, below: int) -> NDArray[np.complex128]:
    """Return the conjugate responses of hats along one axis, (K, U).

    They lie on projector pixels from `above` before q to `below` after it.
    """
    places = _axis_places(centred.near_basis, axis).places
    side = np.arange(-above, below + 1)
    hats = np.maximum(0.0, 1.0 - np.abs(side[:, None] - places[:, 0]) / places[:, 1])
    waves = np.exp(2j * np.pi * centred.basis.cycles[:, axis, None] * side)
    return np.asarray(waves @ (hats / places[:, 1]))


def near_responses(
    coefficients: Floats, centres: NDArray[np.int64], centred: CentredBasis
) -> Floats:
    """Return re-centred responses of near-range light, as the border cuts it, (n, channels, R)."""
    at_border = is_cut(centres, centred.near_basis, centred.basis.projector)
    (cut,), (whole,) = np.nonzero(at_border), np.nonzero(~at_border)
    shape = (*coefficients.shape[:2], centred.basis.count)
    found = np.empty(shape, dtype=np.result_type(coefficients, centred.on_window))
    found[whole] = product_by_row(coefficients[whole], centred.on_window.T)
    for part, distances in cut_alike(centres[cut], centred):
        found[cut[part]] = product_by_row(coefficients[cut[part]], _transposed(centred, distances))
    return found
