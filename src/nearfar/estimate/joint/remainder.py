"""What neighbours' photos have in common that their estimates leave unexplained.

A prior that fits most rows leaves a little of many responses. One camera pixel cannot tell it from
noise. Neighbours see the same surface, and about their own q it is nearly the same for all of them,
so that their mean tells it. It is added to far-range light at the measured frequencies, where it
changes no response to any other.

Index convention: arrays are (C, channels, ...); r runs over real responses, re-centred on q.
"""

import numpy as np

from nearfar.arrays import Floats, Integers, Size, beside, blocks, namespace, product
from nearfar.estimate.joint.batch import RELATIVE_NOISE_FLOOR
from nearfar.estimate.joint.cut import near_responses
from nearfar.estimate.joint.footprint import unit_responses
from nearfar.estimate.joint.pooled_choice import sum_of_neighbours
from nearfar.estimate.joint.problem import EstimatedRows, Problem
from nearfar.estimate.joint.sweep import of_quantisation
from nearfar.illumination.real_basis import RealBasis
from nearfar.parallel import in_batches, on_device_of
from nearfar.transport.direct import direct_weights

# Camera rows on either side, and columns, whose residuals are averaged.
REMAINDER_ROWS = 2
# Camera pixels of a batch; and responses that are averaged at once, of which an even number keeps a
# cosine and its sine together.
BATCH_PIXELS = 2048
RESPONSES_AT_ONCE = 16


def with_remainder(problem: Problem, rows: EstimatedRows) -> EstimatedRows:
    """Return rows with what their neighbours' residuals have in common, as far-range light.

    Camera pixels without direct light have no q about which they are alike, and stay as they are.

    Parameters
    ----------
    problem : Problem
        After the last sweep; its responses are overwritten.
    rows : EstimatedRows
        Of the last sweep; their far-range light is overwritten.
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
    _average(problem)

    def add(batch: slice) -> None:
        rows.far[batch] += centred.uncentre(left[batch], pixels.centres[batch])

    in_batches(add, len(left), BATCH_PIXELS, left)
    return rows


def _average(problem: Problem) -> None:
    """Replace residuals by those that their neighbours have in common."""
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


def _sums(values: Floats, camera: Size) -> Floats:
    """Return the sums of values (C, ...) over the camera pixels about each."""
    found = sum_of_neighbours(values.reshape((*camera, -1)), REMAINDER_ROWS)
    return found.reshape(values.shape)


def _partners(basis: RealBasis) -> Integers:
    """Return the index of each response's other half: a cosine's sine, or itself without one."""
    halves = np.bincount(basis.index)[basis.index]
    return np.arange(basis.count) + np.where(basis.is_sine, -1, halves - 1)
