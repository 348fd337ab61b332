"""What neighbours' photos have in common that their estimates leave unexplained.

A prior that fits most rows leaves a little of many responses. One camera pixel cannot tell it from
noise. Neighbours see the same surface, and about their own q it is nearly the same for all of them,
so that their mean tells it. It is added to far-range light at the measured frequencies, where it
changes no response to any other.

Index convention: arrays are (C, channels, ...); r runs over real responses, re-centred on q.
"""

import numpy as np
from scipy import stats

from nearfar.arrays import Floats, Integers, Size, beside, blocks, fetch, namespace, product
from nearfar.estimate.joint.batch import RELATIVE_NOISE_FLOOR
from nearfar.estimate.joint.cut import near_responses
from nearfar.estimate.joint.footprint import unit_responses
from nearfar.estimate.joint.pooled_choice import sum_of_neighbours
from nearfar.estimate.joint.problem import ComponentChoice, EstimatedRows, Problem
from nearfar.estimate.joint.solve import response_gain
from nearfar.estimate.joint.sweep import of_quantisation
from nearfar.illumination.real_basis import RealBasis
from nearfar.parallel import in_batches, on_device_of
from nearfar.priors.fitted import LIT_COMPONENTS
from nearfar.transport.direct import direct_weights

# Camera rows on either side, and columns, whose residuals are averaged.
REMAINDER_ROWS = 2
# Camera pixels of a batch; and responses that are averaged at once, of which an even number keeps a
# cosine and its sine together.
BATCH_PIXELS = 2048
# Share of the posterior's variance that is left at least: averages have errors, too.
LEAST_UNEXPLAINED = 0.5
RESPONSES_AT_ONCE = 16


def with_remainder(problem: Problem, rows: EstimatedRows) -> tuple[EstimatedRows, Floats]:
    """Add what neighbours' residuals have in common to rows, as far-range light.

    Camera pixels without direct light have no q about which they are alike, and stay as they are.

    Parameters
    ----------
    problem : Problem
        After the last sweep; its responses are overwritten.
    rows : EstimatedRows
        Of the last sweep; their far-range light is overwritten.

    Returns
    -------
    rows : EstimatedRows
    unexplained : array, shape (C, channels), float32
        Share of the posterior's variance of measured responses that is left: what was found is no
        error any more.
    """
    pixels, centred = problem.pixels, problem.model.centred
    left = pixels.responses
    direct = rows.amplitudes[..., 1] * pixels.lit[:, None]
    of_errors = of_quantisation(problem)

    def subtract(batch: slice) -> None:
        centres = pixels.centres[batch]
        light = direct[batch, :, None]
        explained = rows.far[batch] + light * of_errors(batch)[:, None]
        explained += rows.amplitudes[batch, :, :1]
        residual = centred.recentre(left[batch] - explained, centres)
        if problem.near_basis.pitch == 1:
            weights = direct_weights(pixels.correspondence[batch], centres)[:, :1]
            residual -= light * centred.of_direct(weights)
            residual -= product(rows.near[batch], centred.on_window.T)
        else:
            lit = pixels.lit[batch, None]
            middles = np.where(lit, pixels.correspondence[batch] - centres, 0.0)
            residual -= light * unit_responses(middles, pixels.footprint[batch], centred)[:, None]
            residual -= near_responses(rows.near[batch], centres, centred)
        left[batch] = residual

    in_batches(subtract, len(left), BATCH_PIXELS, left)
    by_noise = _average(problem)

    def add(batch: slice) -> None:
        rows.far[batch] += centred.uncentre(left[batch], pixels.centres[batch])

    in_batches(add, len(left), BATCH_PIXELS, left)
    return rows, _unexplained(problem, rows.choices.of_error_bars, by_noise)


def _average(problem: Problem) -> Floats:
    """Replace residuals by those that their neighbours have in common.

    Returns
    -------
    array, shape (C, channels)
        Variance that noise gives a mean of residuals that were measured once.
    """
    pixels, measurements, left = problem.pixels, problem.measurements, problem.pixels.responses
    xp, camera = namespace(left), measurements.camera
    relative = xp.clip(beside(measurements.noise, left) / pixels.white, min=RELATIVE_NOISE_FLOOR)
    # Of residuals as shares of white; each is worth as much as its variance is low.
    weight = pixels.lit[:, None] / relative**2
    weight = xp.astype(weight, xp.float32)
    total = xp.clip(_sums(weight, camera), min=float(np.finfo(np.float32).tiny))
    by_total = pixels.lit[:, None] / total
    partner = beside(_partners(problem.model.centred.basis), left)

    def work(part: slice) -> None:
        shares = left[..., part] * (weight / pixels.white)[..., None]
        mean = _sums(shares, camera) * by_total[..., None]
        # Over the variance that noise alone gives it.
        power = mean**2 * total[..., None] * problem.model.multiplicity[part]
        # All channels, and a cosine and its sine, together: one alone is too noisy.
        power = xp.mean(power, axis=1, keepdims=True)
        power = 0.5 * (power + power[..., partner[part] - part.start])
        mean *= xp.clip(1.0 - 1.0 / xp.clip(power, min=1.0), min=0.0)
        left[..., part] = mean * pixels.white[..., None]

    on_device_of(left)(work, blocks(left.shape[2], RESPONSES_AT_ONCE))
    of_mean: Floats = by_total * pixels.white**2
    return of_mean


def _unexplained(problem: Problem, choice: ComponentChoice | None, by_noise: Floats) -> Floats:
    """Return the share of the posterior's variance that the averages leave, (C, channels)."""
    pixels, model = problem.pixels, problem.model
    assert choice is not None
    by_noise = by_noise * _power_of_noise(problem.measurements.channels)
    xp = namespace(pixels.white)
    found: Floats = xp.ones_like(pixels.white)
    for place in np.unique(fetch(choice.prior_component)).tolist():
        if place >= len(LIT_COMPONENTS):
            continue
        (alike,) = xp.nonzero(choice.prior_component == place)
        noise = pixels.noise[alike]
        ratio = (choice.prior_scale[alike, None] * pixels.white[alike] / noise) ** 2
        variance = noise**2 * response_gain(model.priors[place], ratio)
        explained = xp.mean(pixels.responses[alike] ** 2 * model.multiplicity, axis=-1)
        share = xp.clip(explained - by_noise[alike], min=0.0) / variance
        found[alike] = xp.clip(1.0 - share, min=LEAST_UNEXPLAINED)
    return found


def _power_of_noise(channels: int) -> float:
    """Return the power that is found in means of noise alone, over that of the means.

    The mean of (1 - 1 / p)^2 p where p > 1, the mean of the squares of 2 x channels normal numbers.
    """
    freedom = 2 * channels
    step = 0.01
    power = np.arange(1.0 + 0.5 * step, 20.0, step)
    density = stats.chi2.pdf(freedom * power, freedom) * freedom
    return float(np.sum((power - 1.0) ** 2 / power * density) * step)


def _sums(values: Floats, camera: Size) -> Floats:
    """Return the sums of values (C, ...) over the camera pixels about each."""
    found = sum_of_neighbours(values.reshape((*camera, -1)), REMAINDER_ROWS)
    return found.reshape(values.shape)


def _partners(basis: RealBasis) -> Integers:
    """Return the index of each response's other half: a cosine's sine, or itself without one."""
    halves = np.bincount(basis.index)[basis.index]
    return np.arange(basis.count) + np.where(basis.is_sine, -1, halves - 1)
