"""The posterior mean where the projector's border cuts hats of several projector pixels.

What is cut off a hat sends no light, so its responses depend on how far q is from the border. With
n = L z, C = L L^T its covariance at unit prior scale, z has the precision

    Lambda = I / ratio + (B L)^T D^-1 B L

where f and noise together have the covariance s^2 S + sigma^2 / m = sigma^2 D,
ratio = (s / sigma)^2 and B the responses of the hats as the border cuts them. Camera pixels share a
factor of Lambda where their distances from the border are nearly the same, and so are prior
component and ratio.

Index convention: arrays are (n, channels, ...); r runs over real responses, w over functions, g
over y and the amplitudes of `nuisance`.
"""

from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from nearfar.arrays import Floats, Integers, Size
from nearfar.estimate.joint import nuisance
from nearfar.estimate.joint.batch import PixelBatch
from nearfar.estimate.joint.solve import PosteriorMean, near_noise
from nearfar.illumination.centred_basis import CentredBasis
from nearfar.illumination.near_basis import NearBasis
from nearfar.priors.responses import ResponsePrior

# Distances from the border are rounded to this share of the pitch.
DISTANCE_STEP = 0.5
# Directions of the covariance with less than this share of the largest variance are left out.
LEAST_VARIANCE = 1e-9


def border_distances(centres: NDArray[np.int64], centred: CentredBasis) -> NDArray[np.int64]:
    """Return projector pixels from the rounded q to each border, at most the reach, (C, 4).

    Above, below, to the left and to the right, each rounded.
    """
    projector, basis = centred.basis.projector, centred.near_basis
    last = np.array(projector) - 1 - centres
    distances = np.stack([centres[:, 0], last[:, 0], centres[:, 1], last[:, 1]], axis=1)
    step = max(1, round(DISTANCE_STEP * basis.pitch))
    rounded = np.rint(distances / step).astype(np.int64) * step
    return np.minimum(np.where(distances >= basis.reach, basis.reach, rounded), basis.reach)


def cut_alike(
    centres: NDArray[np.int64], centred: CentredBasis
) -> Iterator[tuple[Integers, tuple[int, int, int, int]]]:
    """Yield camera pixels whose functions are cut alike, and their distances from the border."""
    found, group = np.unique(border_distances(centres, centred), axis=0, return_inverse=True)
    order = np.argsort(group.ravel(), kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(group.ravel()[order])) + 1)
    for part, distances in zip(parts, found.tolist(), strict=True):
        yield part, (distances[0], distances[1], distances[2], distances[3])


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
    found = np.ones((len(centres), len(offsets)), dtype=np.float32)
    for axis in (0, 1):
        above, below = centres[:, axis], projector[axis] - 1 - centres[:, axis]
        places, hat = np.unique(
            np.stack([offsets[:, axis], pitches], axis=1), axis=0, return_inverse=True
        )
        for number, (offset, pitch) in enumerate(places.tolist()):
            mine = hat.ravel() == number
            side = np.arange(-pitch, pitch + 1)
            summed = np.cumsum(np.maximum(0.0, 1.0 - np.abs(side) / pitch) / pitch)
            table = np.concatenate([[0.0], summed])
            # Light at offsets from -above to below.
            upper = table[np.clip(below - offset + pitch + 1, 0, len(table) - 1)]
            lower = table[np.clip(-above - offset + pitch, 0, len(table) - 1)]
            found[:, mine] *= np.maximum(upper - lower, 0.0).astype(np.float32)[:, None]
    return found


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
    found = np.empty((*coefficients.shape[:2], centred.basis.count), dtype=np.float32)
    for part, distances in cut_alike(centres, centred):
        responses = cut_responses(centred, distances).T.astype(np.float32)
        found[part] = coefficients[part] @ responses
    return found


@lru_cache(maxsize=64)
def _root(prior: ResponsePrior) -> Floats:
    """Return L with C = L L^T, (J, J')."""
    variances, vectors = np.linalg.eigh(prior.covariance)
    kept = variances >= LEAST_VARIANCE * variances[-1]
    return np.asarray(vectors[:, kept] * np.sqrt(variances[kept]))


def solve_cut(
    batch: PixelBatch, prior: ResponsePrior, ratio: Floats, centred: CentredBasis
) -> PosteriorMean:
    """Estimate camera pixels of one prior component and rounded ratios; see `solve_whole`."""
    number, channels, count = batch.responses.shape
    multiplicity = np.sum(prior.eigenvectors.astype(np.float64) ** 2, axis=1)
    per_amplitude = nuisance.amplitude_responses(batch, centred)
    precision = nuisance.prior_precision(batch, centred.near_basis)
    amplitudes = np.empty(precision.shape)
    near = np.zeros((number, channels, centred.near_basis.count), dtype=np.float32)
    far = np.empty((number, channels, count), dtype=np.float32)
    root = _root(prior)
    for part, distances in cut_alike(batch.centres, centred):
        patterns = cut_responses(centred, distances) @ root
        of, channel = np.nonzero(np.ones_like(ratio[part], dtype=bool))
        of_pair = ratio[part][of, channel]
        for value in np.unique(of_pair).tolist():
            mine = of_pair == value
            c, i = part[of[mine]], channel[mine]
            weight = 1.0 / (value * prior.far_variance + 1.0 / multiplicity)
            information = (patterns.T * weight) @ patterns
            information[np.diag_indices_from(information)] += 1.0 / value
            y = np.concatenate(
                [batch.responses[c, i, None], per_amplitude[c]], axis=1, dtype=np.float64
            )
            weighted = y * weight
            right = weighted @ patterns
            factor = linalg.cho_factor(information, check_finite=False)
            flat = right.reshape(-1, right.shape[-1]).T
            solved = linalg.cho_solve(factor, flat, check_finite=False).T.reshape(right.shape)
            products = y @ weighted.transpose(0, 2, 1) - right @ solved.transpose(0, 2, 1)
            variance = batch.noise[c, i].astype(np.float64)[:, None] ** 2
            products /= variance[..., None]
            found = nuisance.solve(products[:, 1:, 1:], products[:, 1:, 0], precision[c, i])
            amplitudes[c, i] = found
            factors = np.concatenate([np.ones_like(found[:, :1]), -found], axis=1)
            z = (factors[:, None] @ solved)[:, 0]
            rest = ((factors[:, None] @ y)[:, 0] - z @ patterns.T) * weight
            near[c, i] = z @ root.T
            far[c, i] = rest * (value * prior.far_variance)
    return PosteriorMean(
        amplitudes=nuisance.in_full(amplitudes, batch),
        near=near,
        far=far,
        near_noise=near_noise(batch, prior, ratio),
        score=np.zeros((number, channels, 0), dtype=np.float32),
    )
