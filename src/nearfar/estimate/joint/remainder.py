"""What neighbours' photos have in common that their estimates leave unexplained.

A prior that fits most rows leaves a little of many responses. One camera pixel cannot tell it from
noise. Neighbours see the same surface, and about their own q it is nearly the same for all of them,
so that their mean tells it. It is added to far-range light at the measured frequencies, where it
changes no response to any other.

Index convention: arrays are (C, channels, ...); r runs over real responses, re-centred on q.
"""

import math

import numpy as np

from nearfar.arrays import Floats, Integers, Size, beside, blocks, fetch, namespace, product
from nearfar.estimate.joint.batch import RELATIVE_NOISE_FLOOR
from nearfar.estimate.joint.cut import near_responses
from nearfar.estimate.joint.footprint import unit_responses
from nearfar.estimate.joint.pooled_choice import sum_of_neighbours
from nearfar.estimate.joint.problem import ComponentChoice, EstimatedRows, Problem
from nearfar.estimate.joint.solve import response_gain
from nearfar.estimate.joint.sweep import of_quantisation
from nearfar.illumination.real_basis import RealBasis
from nearfar.parallel import in_batches, one_by_one
from nearfar.priors.fitted import LIT_COMPONENTS
from nearfar.transport.direct import direct_weights

# Camera rows on either side, and columns, whose residuals are averaged.
REMAINDER_ROWS = 2
# Share of the posterior's variance that is left at least: averages have errors, too.
LEAST_UNEXPLAINED = 0.5
# Camera pixels of a batch; and responses that are averaged at once, of which an even number keeps a
# cosine and its sine together.
BATCH_PIXELS = 2048
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
    pixels, centred, left = problem.pixels, problem.model.centred, problem.pixels.responses
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
    variance_of_mean = _average(problem, _relative_noise(problem))
    xp = namespace(left)
    power: Floats = xp.empty_like(pixels.white)

    def add(batch: slice) -> None:
        rows.far[batch] += centred.uncentre(left[batch], pixels.centres[batch])
        # All as shares of white, whose square may be too small a number.
        shares = left[batch] / pixels.white[batch, :, None]
        power[batch] = xp.mean(shares**2 * problem.model.multiplicity, axis=-1)

    in_batches(add, len(left), BATCH_PIXELS, left)
    by_noise = _power_of_noise(problem.measurements.channels) * variance_of_mean
    explained = xp.clip(power - by_noise, min=0.0)
    return rows, _unexplained(problem, rows.choices.of_error_bars, explained)


def _relative_noise(problem: Problem) -> Floats:
    """Return the noise of a response that was measured once, as a share of white, (C, channels)."""
    white = problem.pixels.white
    noise = beside(problem.measurements.noise, white)
    found: Floats = namespace(white).clip(noise / white, min=RELATIVE_NOISE_FLOOR)
    return found


def _average(problem: Problem, relative: Floats) -> Floats:
    """Replace residuals by those that their neighbours have in common.

    Returns
    -------
    array, shape (C, channels)
        Variance of a mean of residuals that were measured once, by noise alone, over white squared.
    """
    pixels, left, camera = problem.pixels, problem.pixels.responses, problem.measurements.camera
    xp = namespace(left)
    # A residual counts by the inverse of its variance.
    weight = xp.astype(pixels.lit[:, None] / relative**2, xp.float32)
    total = xp.clip(_sums(weight, camera), min=float(np.finfo(np.float32).tiny))
    by_total: Floats = pixels.lit[:, None] / total
    partner = beside(_partners(problem.model.centred.basis), left)

    def work(part: slice) -> None:
        shares = left[..., part] * (weight / pixels.white)[..., None]
        mean = _sums(shares, camera) * by_total[..., None]
        # Over its variance by noise alone.
        power = mean**2 * total[..., None] * problem.model.multiplicity[part]
        # All channels, and a cosine and its sine, together: one alone is too noisy.
        power = xp.mean(power, axis=1, keepdims=True)
        power = 0.5 * (power + power[..., partner[part] - part.start])
        mean *= xp.clip(1.0 - 1.0 / xp.clip(power, min=1.0), min=0.0)
        left[..., part] = mean * pixels.white[..., None]

    # In this thread: temporary arrays hold some responses of all camera pixels.
    one_by_one(work, blocks(left.shape[2], RESPONSES_AT_ONCE))
    return by_total


def _unexplained(problem: Problem, choice: ComponentChoice | None, explained: Floats) -> Floats:
    """Return the share of the posterior's variance that is left, (C, channels).

    Parameters
    ----------
    problem : Problem
    choice : ComponentChoice
        Whose posterior the error bars are.
    explained : array, shape (C, channels)
        Mean variance of measured responses that was explained, over white squared.
    """
    pixels, model = problem.pixels, problem.model
    assert choice is not None
    xp = namespace(pixels.white)
    found: Floats = xp.ones_like(pixels.white)
    for place in np.unique(fetch(choice.prior_component)).tolist():
        if place >= len(LIT_COMPONENTS):
            continue
        (alike,) = xp.nonzero(choice.prior_component == place)
        noise = pixels.noise[alike] / pixels.white[alike]
        ratio = (choice.prior_scale[alike, None] / noise) ** 2
        variance = noise**2 * response_gain(model.priors[place], ratio)
        found[alike] = xp.clip(1.0 - explained[alike] / variance, min=LEAST_UNEXPLAINED)
    return found


def _power_of_noise(channels: int) -> float:
    """Return how much power the gains let through of means of noise alone, as a share.

    The expectation of (1 - 1 / p)^2 p over p > 1, where 2 x channels times p is chi-squared with
    as many degrees of freedom.
    """
    freedom = 2 * channels
    step = 0.01
    power = np.arange(1.0 + 0.5 * step, 20.0, step)
    # Of chi-squared; `scipy.stats` has it, and takes half a second to import.
    logarithm = (0.5 * freedom - 1) * np.log(0.5 * freedom * power) - 0.5 * freedom * power
    density = 0.5 * freedom * np.exp(logarithm - math.lgamma(0.5 * freedom))
    return float(np.sum((power - 1.0) ** 2 / power * density) * step)


def _sums(values: Floats, camera: Size) -> Floats:
    """Return the sums of values (C, ...) over the camera pixels about each."""
    found = sum_of_neighbours(values.reshape((*camera, -1)), REMAINDER_ROWS)
    return found.reshape(values.shape)


def _partners(basis: RealBasis) -> Integers:
    """Return the index of each response's other half: a cosine's sine, or itself without one."""
    halves = np.bincount(basis.index)[basis.index]
    return np.arange(basis.count) + np.where(basis.is_sine, -1, halves - 1)
