"""The posterior mean of d, n and f for camera pixels of one prior component and whole windows.

Inside the projector the covariance of the responses is diagonal in the prior's eigenvectors, and
the mean is one product onto them and one back. Where the border clips the window, see `clipped`.

Index convention: arrays are (n, channels, ...); r runs over real responses, i over eigenvectors, w
over window entries, g over the amplitudes of `nuisance`.
"""

from typing import NamedTuple

import numpy as np
from array_api_compat import is_numpy_array

from nearfar.arrays import Floats, beside, namespace, product
from nearfar.estimate.joint import nuisance
from nearfar.estimate.joint.batch import PixelBatch
from nearfar.illumination.centred_basis import CentredBasis
from nearfar.priors.responses import ResponsePrior


class PosteriorMean(NamedTuple):
    """Posterior means of a batch of camera pixels, photo units.

    Attributes
    ----------
    amplitudes : ndarray, shape (n, channels, 4 + E)
        o, the error that the references add to responses; d; d times the error of q down and
        across; and d2 ... of other surfaces.
    near : ndarray, shape (n, channels, W^2)
    far : ndarray, shape (n, channels, R)
        Responses of f, re-centred.
    near_noise : ndarray, shape (n, channels)
        Mean variance of a window entry that the photos' noise causes.
    score : ndarray, shape (n, channels, W^2)
        Gradient of the log evidence by light at each window entry.
    """

    amplitudes: Floats
    near: Floats
    far: Floats
    near_noise: Floats
    score: Floats


def variance_ratio(batch: PixelBatch, scale: Floats) -> Floats:
    """Return (s / sigma)^2 for prior scales s as shares of white, (n, channels), float64."""
    xp = namespace(batch.white)
    ratio: Floats = (scale[:, None] * xp.astype(batch.white, xp.float64) / batch.noise) ** 2
    return ratio


def near_noise(batch: PixelBatch, prior: ResponsePrior, ratio: Floats) -> Floats:
    """Return the mean variance of a window entry that noise causes, shape (n, channels)."""
    known = _in_table(prior.noise_gain, prior, ratio)
    xp = namespace(ratio)
    noise: Floats = xp.astype(batch.noise**2 * known, xp.float32)
    return noise


def response_gain(prior: ResponsePrior, ratio: Floats) -> Floats:
    """Return the mean gain with which responses enter the estimate, shape (n, channels)."""
    xp = namespace(ratio)
    gain: Floats = xp.astype(_in_table(prior.response_gain, prior, ratio), xp.float32)
    return gain


def _in_table(table: Floats, prior: ResponsePrior, ratio: Floats) -> Floats:
    """Look up variance ratios in a table of the prior, between its values."""
    if is_numpy_array(ratio):
        return np.asarray(np.interp(ratio, prior.variance_ratios, table))
    xp = namespace(ratio)
    lowest, highest = float(prior.variance_ratios[0]), float(prior.variance_ratios[-1])
    table, ratios = beside(table, ratio), beside(prior.variance_ratios, ratio)
    # Successive ratios of the table differ by a factor sqrt(2).
    within = xp.clip(ratio, lowest, highest)
    step = xp.astype(xp.floor(2 * xp.log2(within / lowest)), xp.int64)
    step = xp.clip(step, 0, len(prior.variance_ratios) - 2)
    share = (within - ratios[step]) / (ratios[step + 1] - ratios[step])
    found: Floats = table[step] + share * (table[step + 1] - table[step])
    return found


def solve_whole(
    batch: PixelBatch, prior: ResponsePrior, ratio: Floats, centred: CentredBasis
) -> PosteriorMean:
    """Estimate camera pixels of one prior component.

    Parameters
    ----------
    batch : PixelBatch
    prior : ResponsePrior
    ratio : ndarray, shape (n, channels)
        (s / sigma)^2.
    """
    xp = namespace(batch.responses)
    noise = xp.astype(batch.noise[..., None], xp.float32) ** 2
    prior_variance = xp.astype(ratio[..., None], xp.float32) * noise
    weight = 1.0 / (prior_variance * prior.eigenvalues + noise)
    y = product(batch.responses, prior.eigenvectors)
    per_amplitude = nuisance.projected_amplitude_responses(batch, prior)
    transposed = xp.permute_dims(per_amplitude, (0, 2, 1))
    normal, right = [], []
    for i in range(y.shape[1]):
        weighted = per_amplitude * weight[:, i, None]
        normal.append(weighted @ transposed)
        right.append((weighted @ y[:, i, :, None])[..., 0])
    solved = nuisance.solve(
        xp.astype(xp.stack(normal, axis=1), xp.float64),
        xp.astype(xp.stack(right, axis=1), xp.float64),
        nuisance.prior_precision(batch, centred.near_basis),
    )
    amplitudes = xp.astype(solved, xp.float32)
    y -= amplitudes @ per_amplitude
    y *= weight
    score = product(y, prior.of_window.T)
    y *= prior_variance
    return PosteriorMean(
        amplitudes=nuisance.in_full(amplitudes, batch),
        near=product(y, prior.to_near) * batch.inside[:, None],
        far=product(y, prior.to_far),
        near_noise=near_noise(batch, prior, ratio),
        score=score,
    )
