"""Prior scales of error bars by how well each response is foretold by all the others.

The prior component and scale of a camera pixel are the most probable ones for its photos, most of
which show low frequencies. Under them each response is foretold by the others. With K the
covariance of the responses y, o, d and q integrated out, the error is (K^-1 y)_r / (K^-1)_rr and
its variance 1 / (K^-1)_rr (Sundararajan and Keerthi, Neural Computation 13, 2001).

Where these errors are larger than expected by more than chance, so are those of the transport: the
prior scale is multiplied by the mean ratio of their sizes to the expected ones, less `MARGIN`. No
scale is made smaller: it was chosen by the same photos, and fits them a little too well. Each
response counts for the unmeasured ones about it, as in `unmeasured`; camera pixels beside each
other count together.

Index convention: arrays are (n, channels, ...); r runs over real responses, i over eigenvectors, g
over the amplitudes of `nuisance`.
"""

from math import pi, sqrt

import numpy as np
from array_api_compat import device

from nearfar.arrays import Floats, Size, beside, fetch, namespace, product
from nearfar.estimate.joint import nuisance
from nearfar.estimate.joint.batch import PixelBatch
from nearfar.estimate.joint.pooled_choice import sum_of_neighbours
from nearfar.estimate.joint.problem import ComponentChoice, Problem
from nearfar.illumination.near_basis import NearBasis
from nearfar.priors.responses import ResponsePrior

# The mean of the absolute value of a standard normal variable.
MEAN_OF_NORMAL = sqrt(2 / pi)
# Camera pixels on each side whose errors count. With those that have a say in a choice, they are as
# many as the rows beside a tile.
REACH = 1
# Standard deviation of the mean of nine camera pixels by chance, of some 60 responses.
MARGIN = 0.07
# Scales are raised by at most this factor.
LARGEST_FACTOR = 2.0
# Least share of a response's information that is taken to be left once o, d and q are integrated
# out: less is rounding.
LEAST_SHARE = 1e-4


def mean_errors(
    batch: PixelBatch, prior: ResponsePrior, scale: Floats, weights: Floats, near_basis: NearBasis
) -> Floats:
    """Return the mean size of errors of foretold responses over the expected one, (n,).

    Parameters
    ----------
    batch, prior, scale, near_basis
        As `standardised_errors` takes them.
    weights : ndarray, shape (R,), float32
        Of responses; they add up to 1.
    """
    xp = namespace(batch.responses)
    sizes = xp.mean(xp.abs(standardised_errors(batch, prior, scale, near_basis)), axis=1)
    found: Floats = product(sizes, weights[:, None])[:, 0] / MEAN_OF_NORMAL
    return found


def standardised_errors(
    batch: PixelBatch, prior: ResponsePrior, scale: Floats, near_basis: NearBasis
) -> Floats:
    """Return the errors of foretold responses over their standard deviations.

    Parameters
    ----------
    batch : PixelBatch
        Camera pixels with direct light and one prior component.
    prior : ResponsePrior
        Of the component.
    scale : ndarray, shape (n,)
        Prior scales, as shares of white.
    near_basis : NearBasis

    Returns
    -------
    ndarray, shape (n, channels, R), float32
    """
    xp = namespace(batch.responses)
    squared = (scale[:, None] * batch.white)[..., None] ** 2
    precision = 1.0 / (squared * prior.eigenvalues + batch.noise[..., None] ** 2)
    y = product(batch.responses, prior.eigenvectors)
    transposed = xp.permute_dims(prior.eigenvectors, (1, 0))
    per_amplitude = nuisance.projected_amplitude_responses(batch, prior)
    before = nuisance.prior_precision(batch, near_basis)
    weighed_y = product(y * precision, transposed)
    information = product(precision, transposed**2)
    found: Floats = xp.empty_like(y)
    for i in range(y.shape[1]):
        weighted = per_amplitude * precision[:, i, None]
        normal = xp.astype(weighted @ xp.permute_dims(per_amplitude, (0, 2, 1)), xp.float64)
        right = product(weighted, transposed)
        told = xp.astype((weighted @ y[:, i, :, None])[..., 0], xp.float64)
        amplitudes = nuisance.solve(normal[:, None], told[:, None], before[:, i, None])[:, 0]
        errors = weighed_y[:, i] - (xp.astype(amplitudes, xp.float32)[:, None] @ right)[:, 0]
        unit = xp.eye(before.shape[-1], dtype=before.dtype, device=device(before))
        inverse = xp.linalg.inv(normal + before[:, i, :, None] * unit)
        lost = xp.sum(right * (xp.astype(inverse, xp.float32) @ right), axis=1)
        left = xp.maximum(information[:, i] - lost, LEAST_SHARE * information[:, i])
        found[:, i] = errors / xp.sqrt(left)
    return found


def calibrated(choice: ComponentChoice, errors: Floats, camera: Size) -> ComponentChoice:
    """Return prior scales times the mean error of foretold responses, where it is above 1.

    Parameters
    ----------
    choice : ComponentChoice
        Of all camera pixels.
    errors : ndarray, shape (C,)
        As `mean_errors` returns them; NaN at camera pixels without direct light, whose scales stay.
    camera : Size
    """
    xp = namespace(errors)
    known = xp.isfinite(errors)
    counts = xp.astype(known, xp.float32).reshape((*camera, 1))
    sums = xp.where(known, errors, 0.0).reshape((*camera, 1))
    number = xp.clip(sum_of_neighbours(counts, REACH).reshape(-1), min=1.0)
    mean = sum_of_neighbours(sums, REACH).reshape(-1) / number
    factor = xp.where(known, xp.clip(mean - MARGIN, min=1.0, max=LARGEST_FACTOR), 1.0)
    return choice._replace(prior_scale=xp.astype(choice.prior_scale * factor, xp.float32))


def weights_of(problem: Problem) -> Floats:
    """Return each response's share of all that responses stand for, shape (R,), float32."""
    stood_for = fetch(problem.model.stood_for)
    shares = (stood_for / np.sum(stood_for)).astype(np.float32)
    weights: Floats = beside(shares, problem.pixels.responses)
    return weights
