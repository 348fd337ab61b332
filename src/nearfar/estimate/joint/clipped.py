"""The posterior mean where the projector's border clips the window: entries beyond it are zero.

The window is solved for by itself; see `clipped_windows`.

Index convention: arrays are (n, channels, ...); r runs over real responses, w over window entries
inside, g over y and the amplitudes of `nuisance`; m over pairs of a camera pixel and a channel.
"""

from typing import Any

import numpy as np
from array_api_compat import device

from nearfar.arrays import Floats, beside, fetch, namespace, product
from nearfar.estimate.joint import nuisance
from nearfar.estimate.joint.batch import PixelBatch
from nearfar.estimate.joint.clipped_windows import clippings_of, solve_windows
from nearfar.estimate.joint.solve import PosteriorMean, near_noise
from nearfar.illumination.centred_basis import CentredBasis
from nearfar.priors.responses import ResponsePrior


def solve_clipped(
    batch: PixelBatch, prior: ResponsePrior, ratio: Floats, centred: CentredBasis
) -> PosteriorMean:
    """Estimate camera pixels of one prior component and rounded ratios; see `solve_whole`."""
    xp = namespace(batch.responses)
    number, channels, count = batch.responses.shape
    # m, how often each response was measured: the squares of a row add up to it.
    multiplicity = xp.sum(xp.astype(prior.eigenvectors, xp.float64) ** 2, axis=1)
    far_variance, deviation = (
        beside(values, batch.responses) for values in (prior.far_variance, prior.factors.deviation)
    )
    per_amplitude = nuisance.amplitude_responses(batch, centred)
    precision = nuisance.prior_precision(batch, centred.near_basis)
    patterns = xp.astype(centred.on_window, xp.float64) * deviation
    clippings = clippings_of(fetch(batch.inside))

    def empty(*shape: int, dtype: Any = None) -> Any:
        return xp.empty(shape, dtype=dtype or xp.float32, device=device(batch.responses))

    amplitudes = empty(*precision.shape, dtype=xp.float64)
    windows = empty(number, channels, len(deviation))
    far, residual = empty(number, channels, count), empty(number, channels, count)
    ratio_of_pair = fetch(ratio)
    for value in np.unique(ratio_of_pair):
        weight = 1.0 / (float(value) * far_variance + 1.0 / multiplicity)
        of, channel = np.nonzero(ratio_of_pair == value)
        c, i = beside(of, precision), beside(channel, precision)
        y = xp.astype(
            xp.concat([batch.responses[c, i, None], per_amplitude[c]], axis=1), xp.float64
        )
        weighted = y * weight
        right = product(weighted, patterns)
        solved = solve_windows(right, clippings, of, prior, float(value), weight, centred)
        products = y @ xp.permute_dims(weighted, (0, 2, 1))
        products -= right @ xp.permute_dims(solved, (0, 2, 1))
        variance = xp.astype(batch.noise[c, i], xp.float64)[:, None] ** 2
        products /= variance[..., None]
        amplitudes[c, i] = nuisance.solve(products[:, 1:, 1:], products[:, 1:, 0], precision[c, i])
        # y less the responses to the amplitudes.
        factors = xp.concat([xp.ones_like(amplitudes[c, i][:, :1]), -amplitudes[c, i]], axis=1)
        window = (factors[:, None] @ solved)[:, 0]
        rest = ((factors[:, None] @ y)[:, 0] - window @ patterns.T) * weight
        windows[c, i] = xp.astype(window * deviation, xp.float32)
        far[c, i] = xp.astype(rest * (float(value) * far_variance), xp.float32)
        residual[c, i] = xp.astype(rest / variance, xp.float32)
    return PosteriorMean(
        amplitudes=nuisance.in_full(amplitudes, batch),
        near=windows,
        far=far,
        near_noise=near_noise(batch, prior, ratio),
        score=product(residual, centred.on_window),
    )
