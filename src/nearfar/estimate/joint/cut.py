"""The posterior mean where the projector's border cuts hats of several projector pixels.

What is cut off a hat sends no light, so its responses depend on how far q is from the border. With
C = L L^T the hats' covariance at unit prior scale, B their responses as the border cuts them, S the
variance of f and m how often each response was measured, responses have the covariance

    sigma^2 K,  K = ratio (B L L^T B^T + S) + 1 / m,  ratio = (s / sigma)^2

Camera pixels share B L L^T B^T + S where their distances from the border are nearly the same and so
is the prior component, and a factor of K where the ratio is the same as well.

Index convention: arrays are (n, channels, ...); r runs over real responses, w over functions, g
over y and the amplitudes of `nuisance`.
"""

from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from nearfar.arrays import Booleans, Floats, Integers, Size, product
from nearfar.estimate.joint import nuisance
from nearfar.estimate.joint.batch import PixelBatch
from nearfar.estimate.joint.solve import PosteriorMean, near_noise
from nearfar.illumination.centred_basis import CentredBasis
from nearfar.illumination.near_basis import NearBasis
from nearfar.priors.responses import ResponsePrior

# Directions of the covariance with less than this share of the largest variance are left out.
LEAST_VARIANCE = 1e-9


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
    return _rounded(near_basis.reach)[np.minimum(distances, near_basis.reach)]


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
    found, group = np.unique(distances, axis=0, return_inverse=True)
    order = np.argsort(group.ravel(), kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(group.ravel()[order])) + 1)
    for part, at in zip(parts, found.tolist(), strict=True):
        yield part, (at[0], at[1], at[2], at[3])


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
    found = product(coefficients, centred.on_window.T)
    (cut,) = np.nonzero(is_cut(centres, centred.near_basis, centred.basis.projector))
    for part, distances in cut_alike(centres[cut], centred):
        responses = cut_responses(centred, distances).T.astype(np.float32)
        found[cut[part]] = coefficients[cut[part]] @ responses
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
    per_amplitude = nuisance.amplitude_responses(batch, centred)
    y = np.empty((number, channels, 1 + per_amplitude.shape[1], count))
    y[:, :, 0], y[:, :, 1:] = batch.responses, per_amplitude[:, None]
    solved = np.empty_like(y)
    root = _root(prior)
    noise_variance = 1.0 / np.sum(prior.eigenvectors.astype(np.float64) ** 2, axis=1)
    alike = [
        (part, cut_responses(centred, at) @ root) for part, at in cut_alike(batch.centres, centred)
    ]
    for part, patterns in alike:
        covariance = patterns @ patterns.T
        covariance[np.diag_indices(count)] += prior.far_variance
        for value, of, channel in _of_one_ratio(ratio[part]):
            at = part[of], channel
            solved[at] = _solve(value * covariance, noise_variance, y[at])
    variance = batch.noise.astype(np.float64)[..., None, None] ** 2
    products = y @ np.swapaxes(solved, -1, -2) / variance
    precision = nuisance.prior_precision(batch, centred.near_basis)
    amplitudes = nuisance.solve(products[..., 1:, 1:], products[..., 1:, 0], precision)
    # K^-1 times the responses less those to the amplitudes.
    rest = solved[:, :, 0] - np.einsum("nig,nigr->nir", amplitudes, solved[:, :, 1:])
    rest *= ratio[..., None]
    near = np.empty((number, channels, centred.near_basis.count), dtype=np.float32)
    for part, patterns in alike:
        near[part] = rest[part] @ patterns @ root.T
    return PosteriorMean(
        amplitudes=nuisance.in_full(amplitudes, batch),
        near=near,
        far=(rest * prior.far_variance).astype(np.float32),
        near_noise=near_noise(batch, prior, ratio),
        score=np.zeros((number, channels, 0), dtype=np.float32),
    )


def _of_one_ratio(ratio: Floats) -> Iterator[tuple[float, Integers, Integers]]:
    """Yield each variance ratio that occurs, with its camera pixels and channels."""
    flat = ratio.ravel()
    order = np.argsort(flat, kind="stable")
    ends = np.flatnonzero(np.diff(flat[order])) + 1
    for places in np.split(order, ends):
        yield float(flat[places[0]]), *np.divmod(places, ratio.shape[1])


def _solve(covariance: Floats, noise_variance: Floats, y: Floats) -> Floats:
    """Return (covariance + diag(noise_variance))^-1 y, y (..., R); overwrite the covariance."""
    covariance[np.diag_indices_from(covariance)] += noise_variance
    # Symmetric, and so the same in Fortran's order.
    factor, failed = lapack.dpotrf(covariance.T, lower=1, overwrite_a=1, clean=0)
    if failed:
        raise np.linalg.LinAlgError("the covariance of responses is not positive definite")
    solved, _ = lapack.dpotrs(factor, y.reshape(-1, y.shape[-1]).T, lower=1)
    return np.asarray(solved.T.reshape(y.shape))
