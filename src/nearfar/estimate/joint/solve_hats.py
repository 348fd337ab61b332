"""The posterior mean of d, n and f where functions are of several projector pixels.

Where a prior component expects less of an eigenvector than noise by far, photos tell nothing of it.
With the leading eigenvectors e_i, of eigenvalues l_i, alone, and p the prior's variance,

    K^-1 = M - sum_i (1 - v / (p l_i + v)) e_i e_i^T,  M = diag(m) / v,  v the noise's variance,

so that products are with a part of the eigenvectors, and M takes a pass over the responses.

The border's cuts of functions are left out of account here. What they change is subtracted before
the next sweep, as responses to what was found are exact, and with each sweep less is left of it.

Index convention: arrays are (n, channels, ...); r runs over real responses, i over leading
eigenvectors, j over functions, g and h over the amplitudes of `nuisance`.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, Integers, product_by_row
from nearfar.compiled import compiled
from nearfar.estimate.joint import nuisance
from nearfar.estimate.joint.batch import PixelBatch
from nearfar.estimate.joint.factors import solve_small
from nearfar.illumination.near_basis import NearBasis
from nearfar.priors.responses import ResponsePrior

# Least variance of an eigenvector's coordinate, as a share of the noise's. No light's SNR is more
# than 0.02 dB off that by all eigenvectors.
LEAST_VARIANCE = 0.01
# Leading eigenvectors are counted in multiples of as many, so that camera pixels share a number.
MULTIPLE = 32
# Sums are over a multiple of as many numbers: those that a processor adds up at once.
LANES = 16


class Leading(NamedTuple):
    """The leading eigenvectors of a prior component.

    Attributes
    ----------
    eigenvalues : ndarray, shape (I,), float32
    eigenvectors : ndarray, shape (R, I), float32
    to_both : ndarray, shape (I, J + R), float32
        From weights of the eigenvectors to functions, and to what they take from f's responses.
    multiplicity : ndarray, shape (R,), float32
        m, how often each response was measured.
    far_variance : ndarray, shape (R,), float32
        Of f's responses, at unit prior scale.
    """

    eigenvalues: Floats
    eigenvectors: Floats
    to_both: Floats
    multiplicity: Floats
    far_variance: Floats


@lru_cache(maxsize=256)
def _leading(prior: ResponsePrior, count: int) -> Leading:
    eigenvalues = prior.eigenvalues[:count]
    taken = eigenvalues[:, None] * prior.to_far[:count]
    return Leading(
        eigenvalues,
        np.ascontiguousarray(prior.eigenvectors[:, :count]),
        np.concatenate([prior.to_near[:count], taken], axis=1, dtype=np.float32),
        # The squares of a row add up to it.
        np.sum(prior.eigenvectors.astype(np.float64) ** 2, axis=1).astype(np.float32),
        prior.far_variance.astype(np.float32),
    )


def leading_count(prior: ResponsePrior, ratio: Floats) -> Integers:
    """Return how many eigenvectors photos tell of, for each variance ratio."""
    rising = prior.eigenvalues[::-1].astype(np.float64)
    small = np.searchsorted(rising, LEAST_VARIANCE / np.maximum(ratio, 1e-30))
    most = len(rising)
    return np.asarray(np.clip(-(-(most - small) // MULTIPLE) * MULTIPLE, MULTIPLE, most))


class HatsMean(NamedTuple):
    """Posterior means of a batch of camera pixels, photo units.

    Attributes
    ----------
    amplitudes : ndarray, shape (n, channels, 4)
    near : ndarray, shape (n, channels, J)
    far : ndarray, shape (n, channels, R)
        Responses of f, re-centred.
    near_noise : ndarray, shape (n, channels)
        As in `PosteriorMean`.
    misfit : ndarray, shape (n,)
        Squares of what the amplitudes leave of the responses, in units of their variance: about as
        much as there are responses in all channels.
    """

    amplitudes: Floats
    near: Floats
    far: Floats
    near_noise: Floats
    misfit: Floats


def solve_hats(
    batch: PixelBatch,
    units: Floats,
    prior: ResponsePrior,
    ratio: Floats,
    count: int,
    near_basis: NearBasis,
) -> HatsMean:
    """Estimate camera pixels of one prior component.

    Parameters
    ----------
    batch : PixelBatch
        Its responses are overwritten.
    units : ndarray, shape (n, G, R), float32
        Responses to unit amplitudes, as `nuisance.amplitude_responses` gives them.
    prior : ResponsePrior
    ratio : ndarray, shape (n, channels)
        Variance ratios (s / sigma)^2.
    count : int
        Number of leading eigenvectors, as `leading_count` says for the largest ratio.
    near_basis : NearBasis
    """
    number, channels, responses = batch.responses.shape
    functions = near_basis.count
    leading = _leading(prior, count)
    y = product_by_row(batch.responses, leading.eigenvectors)
    precision = nuisance.prior_precision(batch, near_basis)
    noise_variance = batch.noise.ravel() ** 2
    amplitudes, misfit = fit_leading(
        batch.responses.reshape(-1, responses),
        y.reshape(number * channels, -1),
        units,
        product_by_row(units, leading.eigenvectors),
        np.repeat(np.arange(number), channels),
        leading.eigenvalues,
        leading.multiplicity,
        noise_variance,
        ratio.ravel().astype(np.float32) * noise_variance,
        np.ascontiguousarray(precision.reshape(number * channels, -1)),
    )
    both = product_by_row(y, leading.to_both)
    far = np.empty_like(batch.responses)
    _far(batch.responses, both, functions, ratio, leading.multiplicity, leading.far_variance, far)
    known = np.interp(ratio, prior.variance_ratios, prior.noise_gain)
    return HatsMean(
        amplitudes=nuisance.in_full(amplitudes.reshape(precision.shape), batch),
        near=both[..., :functions],
        far=far,
        near_noise=np.asarray(batch.noise**2 * known, dtype=np.float32),
        misfit=misfit.reshape(number, channels).sum(axis=1),
    )


@compiled
def _put_normal(
    both: Floats, weight: Floats, weighted: Floats, normal: Floats, right: Floats
) -> None:
    """Write weighted sums of products of units (G, whole), and of them and the measured row."""
    number, whole = weighted.shape
    for g in range(number):
        for r in range(whole):
            weighted[g, r] = weight[r] * both[g, r]
        total = 0.0
        for r in range(whole):
            total += weighted[g, r] * both[number, r]
        right[g] = total
        for h in range(g + 1):
            total = 0.0
            for r in range(whole):
                total += weighted[g, r] * both[h, r]
            normal[g, h] = total


@compiled
def fit_leading(
    responses: Floats,
    y: Floats,
    units: Floats,
    of_units: Floats,
    pixel: Integers,
    eigenvalues: Floats,
    multiplicity: Floats,
    noise_variance: Floats,
    prior_variance: Floats,
    precision: Floats,
) -> tuple[Floats, Floats]:
    """Estimate amplitudes, and overwrite responses by what they leave.

    Parameters
    ----------
    responses : ndarray, shape (m, R), float32
        Overwritten by themselves less those to the amplitudes.
    y : ndarray, shape (m, I), float32
        Their coordinates; overwritten by prior_variance / (prior_variance eigenvalues +
        noise_variance) times those of what is left.
    units, of_units : ndarray, shapes (n, G, R) and (n, G, I), float32
        Responses to unit amplitudes, and their coordinates.
    pixel : ndarray of int, shape (m,)
        Camera pixel of each row.
    eigenvalues : ndarray, shape (I,), float32
    multiplicity : ndarray, shape (R,), float32
    noise_variance, prior_variance : ndarray, shape (m,), float32
    precision : ndarray, shape (m, G), float64
        Prior precision of the amplitudes.

    Returns
    -------
    amplitudes : ndarray, shape (m, G), float64
    misfit : ndarray, shape (m,), float64
    """
    number, count = units.shape[1:]
    leading = len(eigenvalues)
    amplitudes, normal = np.empty((len(responses), number)), np.empty((number, number))
    right, misfit = np.empty(number), np.empty(len(responses))
    # The responses and their leading coordinates, one after the other: units, and what is measured.
    # Sums of what the leading eigenvectors leave are small differences of large numbers.
    # Zeros fill the last vector instructions.
    whole = -(-(count + leading) // LANES) * LANES
    both, weighted = np.zeros((number + 1, whole)), np.zeros((number, whole))
    weight = np.zeros(whole)
    for m in range(len(responses)):
        n, precise = pixel[m], 1.0 / np.float64(noise_variance[m])
        for r in range(count):
            weight[r] = precise * np.float64(multiplicity[r])
            both[number, r] = responses[m, r]
        for i in range(leading):
            variance = prior_variance[m] * eigenvalues[i]
            weight[count + i] = -precise * np.float64(variance / (variance + noise_variance[m]))
            both[number, count + i] = y[m, i]
        for g in range(number):
            for r in range(count):
                both[g, r] = units[n, g, r]
            for i in range(leading):
                both[g, count + i] = of_units[n, g, i]
        _put_normal(both, weight, weighted, normal, right)
        for g in range(number):
            normal[g, g] += precision[m, g]
        solve_small(normal, right)
        for g in range(number):
            amplitudes[m, g] = right[g]
            times = np.float32(right[g])
            for r in range(count):
                responses[m, r] -= times * units[n, g, r]
            for i in range(leading):
                y[m, i] -= times * of_units[n, g, i]
        squares, less = np.float32(0.0), np.float32(0.0)
        for r in range(count):
            squares += multiplicity[r] * responses[m, r] * responses[m, r]
        for i in range(leading):
            times = y[m, i] / (prior_variance[m] * eigenvalues[i] + noise_variance[m])
            times *= prior_variance[m]
            less += eigenvalues[i] * times * y[m, i]
            y[m, i] = times
        misfit[m] = (np.float64(squares) - np.float64(less)) * precise
    return amplitudes, misfit


@compiled
def _far(
    left: Floats,
    both: Floats,
    functions: int,
    ratio: Floats,
    multiplicity: Floats,
    far_variance: Floats,
    far: Floats,
) -> None:
    """Write f's responses: S K^-1 times what is left of the responses."""
    for n in range(len(left)):
        for channel in range(left.shape[1]):
            scale = np.float32(ratio[n, channel])
            found, rest = far[n, channel], left[n, channel]
            taken = both[n, channel, functions:]
            for r in range(len(found)):
                found[r] = scale * (far_variance[r] * multiplicity[r] * rest[r] - taken[r])
