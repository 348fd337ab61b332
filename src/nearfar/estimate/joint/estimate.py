"""The joint estimate: direct, near and far in one model, each camera pixel with a prior of its own.

In the first sweep every camera pixel chooses a prior component and scale by its own photos and
takes the posterior mean. Later sweeps start from what is expected from its neighbours and estimate
the difference.
"""

from collections.abc import Callable
from itertools import zip_longest

import numpy as np

from nearfar.arrays import Floats, Size, beside, namespace
from nearfar.devices import Device
from nearfar.estimate.joint.assemble import assemble
from nearfar.estimate.joint.nuisance import COMMON_AMPLITUDES
from nearfar.estimate.joint.problem import ComponentChoice, EstimatedRows, Problem, lay_out
from nearfar.estimate.joint.sweep import sweep_once
from nearfar.photometry.measurements import Measurements
from nearfar.transport.model import Transport

# Prior components and scales of camera pixels, one choice for each sweep.
Choices = tuple[ComponentChoice, ...]
# Sweeps: one by each camera pixel's own photos alone, the rest with its neighbours.
SWEEPS = 3
# q moves by no more projector pixels than this in one sweep, and stays where it was rounded to.
LARGEST_SHIFT = 0.25
LARGEST_FROM_CENTRE = 0.499


def estimate_jointly(
    measurements: Measurements,
    correspondence: Floats,
    window: int,
    far: Size,
    *,
    sweeps: int = SWEEPS,
    chosen: Choices = (),
    device: Device = "cpu",
    progress: Callable[[float], None] | None = None,
) -> Transport:
    """Estimate D, N and F together.

    Parameters
    ----------
    measurements : Measurements
        With white, and at least one other frequency.
    correspondence : ndarray, shape (Cy, Cx, 2)
        q as (y, x), NaN where there is no direct light. The transport's own is rounded where it
        is nearly whole, and else moved by the little that the photos ask for.
    window : int
        W, an upper bound of how far near-range light reaches.
    far : Size
        Far band: f is kept at its measured frequencies.
    sweeps : int
        The first by each camera pixel's own photos alone, the rest with its neighbours.
    chosen : Choices
        Prior components and scales that `choose_components` chose by some of the photos.
    device : {"cpu", "cuda", "torch"}
        Where the work is done: by NumPy, by PyTorch on an accelerator, or by PyTorch on the
        processor.
    progress : callable, optional
        Called with the share done.

    Returns
    -------
    Transport

    Raises
    ------
    InputError
        If white or everything else is missing, or the device is.
    """
    report = progress or (lambda _share: None)
    problem = lay_out(measurements, correspondence, window, device)
    return assemble(*_sweep(problem, sweeps, chosen, report), far)


def choose_components(
    measurements: Measurements,
    correspondence: Floats,
    window: int,
    *,
    device: Device = "cpu",
    progress: Callable[[float], None] | None = None,
) -> Choices:
    """Choose each camera pixel's prior component by some photos, to estimate from more of them.

    Parameters and errors are those of `estimate_jointly`.

    Returns
    -------
    Choices
        One for each sweep.
    """
    report = progress or (lambda _share: None)
    problem = lay_out(measurements, correspondence, window, device)
    _, rows = _sweep(problem, SWEEPS, (), report)
    return rows.choices


def _sweep(
    problem: Problem, sweeps: int, chosen: Choices, progress: Callable[[float], None]
) -> tuple[Problem, EstimatedRows]:
    """Sweep so many times, q moved after each."""
    rows = None
    for number, choice in zip_longest(range(sweeps), chosen[:sweeps]):

        def report(share: float, number: int = number) -> None:
            progress((number + share) / sweeps)

        rows = sweep_once(problem, rows, report, choice)
        pixels = problem.pixels._replace(correspondence=_moved(problem, rows))
        problem = problem._replace(pixels=pixels)
    assert rows is not None
    return problem, rows


def _moved(problem: Problem, rows: EstimatedRows) -> Floats:
    """Move q by what it was found to be off, but no further than its rounding allows."""
    xp = namespace(rows.amplitudes)
    amplitudes = xp.astype(rows.amplitudes, xp.float64)
    direct = amplitudes[..., 1]
    energy = xp.clip(xp.sum(direct**2, axis=1), min=float(np.finfo(np.float32).tiny))
    shifts = amplitudes[..., 2:COMMON_AMPLITUDES]
    off = xp.sum(shifts * direct[..., None], axis=1) / energy[:, None]
    within = xp.clip(off, -LARGEST_SHIFT, LARGEST_SHIFT)
    off = xp.where((xp.sum(direct, axis=1) > 0)[:, None], within, 0.0)
    pixels, centres = problem.pixels, xp.astype(problem.pixels.centres, xp.float64)
    last = beside(np.array(problem.measurements.projector) - 1.0, amplitudes)
    lowest = xp.clip(centres - LARGEST_FROM_CENTRE, min=0.0)
    highest = xp.minimum(centres + LARGEST_FROM_CENTRE, last)
    moved: Floats = xp.maximum(xp.minimum(pixels.correspondence + off, highest), lowest)
    return moved
