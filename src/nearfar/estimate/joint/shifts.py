"""Shifts of q by its estimated error, and the light that a shift does not reach.

Direct light's responses are linear in d and in d times what q is off by, for small errors. q takes
the error up, but stays close to the pixel that its window is placed about. What it does not take up
is light all the same, next to q, and goes to the window.

Index convention: arrays are (C, channels, ...).
"""

import numpy as np

from nearfar.arrays import Booleans, Floats, beside, namespace
from nearfar.estimate.joint.nuisance import COMMON_AMPLITUDES
from nearfar.estimate.joint.problem import EstimatedRows, Problem
from nearfar.estimate.joint.spikes import around_q
from nearfar.transport.direct import direct_weights

# Largest shift of q in one sweep, in projector pixels, and largest distance of q from its rounded
# value.
LARGEST_SHIFT = 0.25
# The same where footprints are boxes, whose responses are not linear in q.
LARGEST_SHIFT_AT_PITCH = 0.12
# Near-range light next to q looks like a small error of q, which correspondence knows better. Where
# it is more than this share of direct light, q is shifted by this distance at least, or not at all:
# windows of single projector pixels have what q does not reach (docs/decisions/0123).
LEAST_NEAR_SHARE, LEAST_SHIFT = 0.1, 0.1
LARGEST_FROM_CENTRE = 0.499


def moved_q(problem: Problem, rows: EstimatedRows, lit: Booleans, *, is_last: bool) -> Floats:
    """Shift q by its estimated error, (C, 2).

    At most to where it would round to another pixel, unless windows are placed anew about it. It is
    NaN where the photos turned out to show no direct light.
    """
    xp = namespace(rows.amplitudes)
    off = _errors_of_q(rows)
    largest = LARGEST_SHIFT if problem.near_basis.pitch == 1 else LARGEST_SHIFT_AT_PITCH
    off = xp.clip(off, -largest, largest)
    pixels, centres = problem.pixels, xp.astype(problem.pixels.centres, xp.float64)
    last = beside(np.array(problem.measurements.projector) - 1.0, off)
    most = LARGEST_FROM_CENTRE if is_last or problem.near_basis.pitch == 1 else np.inf
    lowest = xp.clip(centres - most, min=0.0)
    highest = xp.minimum(centres + most, last)
    moved: Floats = xp.maximum(xp.minimum(pixels.correspondence + off, highest), lowest)
    if problem.near_basis.pitch == 1:
        is_small = xp.max(xp.abs(moved - pixels.correspondence), axis=-1) < LEAST_SHIFT
        stays = is_small & _is_beside_near_range_light(problem, rows)
        moved = xp.where(stays[:, None], pixels.correspondence, moved)
    seen: Floats = xp.where(lit[:, None], moved, xp.nan)
    return seen


def with_unshifted_light(problem: Problem, moved: Floats, rows: EstimatedRows) -> EstimatedRows:
    """Add to windows what direct light lacks because q was not shifted by all of its error.

    Windows of single projector pixels, before q was moved.

    Parameters
    ----------
    problem : Problem
        Before q was moved.
    moved : ndarray, shape (C, 2)
        q afterwards.
    rows : EstimatedRows
    """
    pixels, window = problem.pixels, problem.near_basis.window
    around = around_q(window)
    if not len(around):
        return rows
    xp = namespace(rows.near)
    direct = xp.astype(rows.amplitudes[..., 1:2], xp.float64)
    shifts = xp.astype(rows.amplitudes[..., 2:COMMON_AMPLITUDES], xp.float64)
    is_bright = xp.sum(direct, axis=1, keepdims=True) > 0
    left = _errors_of_q(rows) - (moved - pixels.correspondence)
    lost = xp.where(is_bright, direct * left[:, None], shifts)
    lost = xp.where(xp.isfinite(moved)[:, None], lost, 0.0)
    derivatives = direct_weights(pixels.correspondence, pixels.centres)[:, 1:]
    windows = xp.asarray(rows.near, copy=True)
    light = lost @ xp.astype(derivatives, xp.float64)
    windows[..., beside(around, windows)] += xp.astype(light, windows.dtype)
    return rows._replace(near=windows)


def _is_beside_near_range_light(problem: Problem, rows: EstimatedRows) -> Booleans:
    """Return whether there is near-range light next to q, (C,)."""
    xp = namespace(rows.near)
    around = around_q(problem.near_basis.window)
    next_to_q = xp.sum(rows.near[..., beside(around, rows.near)], axis=1)
    light = xp.sum(xp.abs(next_to_q), axis=-1)
    found: Booleans = light > LEAST_NEAR_SHARE * xp.abs(xp.sum(rows.amplitudes[..., 1], axis=1))
    return found


def _errors_of_q(rows: EstimatedRows) -> Floats:
    """Return how far q is off, (C, 2), float64; 0 where direct light is not above 0."""
    xp = namespace(rows.amplitudes)
    amplitudes = xp.astype(rows.amplitudes, xp.float64)
    direct = amplitudes[..., 1]
    energy = xp.clip(xp.sum(direct**2, axis=1), min=float(np.finfo(np.float32).tiny))
    shifts = amplitudes[..., 2:COMMON_AMPLITUDES]
    off = xp.sum(shifts * direct[..., None], axis=1) / energy[:, None]
    found: Floats = xp.where((xp.sum(direct, axis=1) > 0)[:, None], off, 0.0)
    return found
