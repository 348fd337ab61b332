"""The posterior mean where the projector's border clips the window: entries beyond it are zero.

The window is solved for by itself; see `clipped_windows`.

Index convention: arrays are (n, channels, ...); r runs over real responses, w over window entries
inside, g over y and the amplitudes of `nuisance`; m over pairs of a camera pixel and a channel.
"""

import numpy as np

from nearfar.arrays import Floats, beside, fetch, namespace, product
from nearfar.estimate.joint import nuisance
from nearfar.estimate.joint.batch import PixelBatch
from nearfar.estimate.joint.clipped_windows import Ratios, clippings_of, solve_windows
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
    ratios, ratio_of_pair = np.unique(fetch(ratio), return_inverse=True)
    of_pair = ratio_of_pair.ravel()
    table = 1.0 / (beside(ratios[:, None], far_variance) * far_variance + 1.0 / multiplicity)
    weight = table[beside(of_pair, table)][:, None]
    # y and the responses to amplitudes, of each pair.
    alike = xp.broadcast_to(
        per_amplitude[:, None], (number, channels, per_amplitude.shape[1], count)
    )
    y = xp.concat([batch.responses[:, :, None], alike], axis=2)
    y = xp.astype(y, xp.float64).reshape((number * channels, y.shape[2], count))
    weighted = y * weight
    right = product(weighted, patterns)
    of = np.repeat(np.arange(number), channels)
    solved = solve_windows(right, clippings, of, prior, Ratios(ratios, of_pair, table), centred)
    products = y @ xp.permute_dims(weighted, (0, 2, 1))
    products -= right @ xp.permute_dims(solved, (0, 2, 1))
    variance = xp.astype(batch.noise, xp.float64).reshape((-1, 1)) ** 2
    products /= variance[..., None]
    shape = precision.shape
    amplitudes = nuisance.solve(
        products[:, 1:, 1:], products[:, 1:, 0], precision.reshape((-1, shape[2]))
    )
    # y less the responses to the amplitudes.
    factors = xp.concat([xp.ones_like(amplitudes[:, :1]), -amplitudes], axis=1)[:, None]
    window = (factors @ solved)[:, 0]
    rest = ((factors @ y)[:, 0] - window @ patterns.T) * weight[:, 0]
    of_far = beside(ratios[of_pair, None], rest) * far_variance

    def by_pixel(values: Floats) -> Floats:
        """Return values of pairs, (n, channels, ...), float32."""
        found: Floats = xp.astype(values, xp.float32).reshape((number, channels, -1))
        return found

    residual = by_pixel(rest / variance)
    return PosteriorMean(
        amplitudes=nuisance.in_full(amplitudes.reshape(shape), batch),
        near=by_pixel(window * deviation),
        far=by_pixel(rest * of_far),
        near_noise=near_noise(batch, prior, ratio),
        score=product(residual, centred.on_window),
    )
