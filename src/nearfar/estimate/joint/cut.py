"""The posterior mean where the projector's border cuts hats of several projector pixels.

What is cut off a hat sends no light, so its responses depend on how far q is from the border. With
C the hats' covariance at unit prior scale, B their responses as the border cuts them, S the
variance of f and m how often each response was measured, responses have the covariance

    sigma^2 K,  K = ratio (B C B^T + S) + 1 / m,  ratio = (s / sigma)^2

Camera pixels share B C B^T + S where their distances from the border are nearly the same and so
is the prior component, and a factor of K where the ratio is the same as well.

Index convention: arrays are (n, channels, ...); r runs over real responses, w over functions, g
over y and the amplitudes of `nuisance`.
"""

from collections.abc import Iterator
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Integers, Size, product_by_row
from nearfar.estimate.joint import nuisance
from nearfar.estimate.joint.batch import PixelBatch
from nearfar.estimate.joint.cut_solve import solve_alike
from nearfar.estimate.joint.solve import PosteriorMean, near_noise
from nearfar.illumination.centred_basis import CentredBasis
from nearfar.illumination.near_basis import NearBasis
from nearfar.priors.responses import ResponsePrior


def is_cut(
    centres: NDArray[np.int64], near_basis: NearBasis, projector: Size, within: int | None = None
) -> Booleans:
    """Return whether the border cuts functions about each rounded q, shape (C,).

    `within` is that of `border_distances`.
    """
    distances = border_distances(centres, near_basis, projector, within)
    return np.asarray((distances < near_basis.reach).any(axis=1))


def border_distances(
    centres: NDArray[np.int64], near_basis: NearBasis, projector: Size, within: int | None = None
) -> NDArray[np.int64]:
    """Return projector pixels from the rounded q to each border, at most the reach, (C, 4).

    Above, below, to the left and to the right, each rounded to one of those that `_rounded` lists.
    Distances of at least `within` count as the reach.
    """
    last = np.array(projector) - 1 - centres
    distances = np.stack([centres[:, 0], last[:, 0], centres[:, 1], last[:, 1]], axis=1)
    found = _rounded(near_basis.reach)[np.minimum(distances, near_basis.reach)]
    return found if within is None else np.where(distances < within, found, near_basis.reach)


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
    centres: NDArray[np.int64], centred: CentredBasis, within: int | None = None
) -> Iterator[tuple[Integers, tuple[int, int, int, int]]]:
    """Yield camera pixels whose functions are cut alike, and their distances from the border.

    `within` is that of `border_distances`.
    """
    if not len(centres):
        return
    distances = border_distances(centres, centred.near_basis, centred.basis.projector, within)
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


# Those of the same batch, whose camera pixels' components follow each other.
@lru_cache(maxsize=64)
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
        responses = cut_responses(centred, distances).T.astype(np.float32)
        found[cut[part]] = product_by_row(coefficients[cut[part]], responses)
    return found


def solve_cut(
    batch: PixelBatch, prior: ResponsePrior, ratio: Floats, centred: CentredBasis
) -> PosteriorMean:
    """Estimate camera pixels of one prior component and rounded ratios; see `solve_whole`."""
    number, channels, count = batch.responses.shape
    per_amplitude = nuisance.amplitude_responses(batch, centred)
    precision = nuisance.prior_precision(batch, centred.near_basis)
    noise_variance = 1.0 / np.sum(prior.eigenvectors.astype(np.float64) ** 2, axis=1)
    amplitudes = np.empty(precision.shape)
    near = np.empty((number, channels, centred.near_basis.count), dtype=np.float32)
    far = np.empty((number, channels, count), dtype=np.float32)
    for part, at in cut_alike(batch.centres, centred, prior.reach):
        patterns = cut_responses(centred, at)
        # Hats beyond the border answer nothing.
        inside = np.flatnonzero(patterns.any(axis=0))
        to_near = patterns[:, inside] @ prior.covariance[inside]
        covariance = to_near[:, inside] @ patterns[:, inside].T
        covariance[np.diag_indices(count)] += prior.far_variance
        pixel, channel = np.divmod(np.argsort(ratio[part], axis=None, kind="stable"), channels)
        of = part[pixel], channel
        ratios = ratio[of]
        starts = _starts(ratios)
        found, rest, is_definite = solve_alike(
            covariance,
            noise_variance,
            ratios[starts[:-1]],
            starts,
            batch.responses[of],
            per_amplitude[of[0]],
            precision[of] * batch.noise[of].astype(np.float64)[:, None] ** 2,
        )
        if not is_definite:
            raise np.linalg.LinAlgError("the covariance of responses is not positive definite")
        amplitudes[of] = found
        near[of] = product_by_row(rest, to_near)
        far[of] = rest * prior.far_variance
    return PosteriorMean(
        amplitudes=nuisance.in_full(amplitudes, batch),
        near=near,
        far=far,
        near_noise=near_noise(batch, prior, ratio),
        score=np.zeros((number, channels, 0), dtype=np.float32),
    )
