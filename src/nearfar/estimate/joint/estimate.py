"""The joint estimate: direct, near and far in one model, each camera pixel by its own kind.

First every camera pixel chooses a kind and a strength by its own photos and takes the posterior
mean. Then, in turns, each starts from what its neighbours expect and estimates what differs.
"""

from collections.abc import Callable
from itertools import zip_longest

import numpy as np

from nearfar.arrays import Floats, Size, beside, namespace
from nearfar.devices import Device
from nearfar.estimate.joint.assemble import assemble
from nearfar.estimate.joint.nuisance import KEPT
from nearfar.estimate.joint.problem import Choice, Problem, Rows, lay_out
from nearfar.estimate.joint.turn import take_turn
from nearfar.photometry.measurements import Measurements
from nearfar.transport.model import Transport

# Kinds of camera pixels, one choice for each turn.
Choices = tuple[Choice, ...]
# Turns: one alone, the rest with the neighbours.
TURNS = 3
# q moves by no more than this in one turn, and stays where it was rounded to.
FURTHEST = 0.25
HALF = 0.499


def estimate_jointly(
    measurements: Measurements,
    correspondence: Floats,
    window: int,
    far: Size,
    *,
    turns: int = TURNS,
    kept: Choices = (),
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
        W: near-range light lies within, however much less far it reaches.
    far : Size
        Far band: f is kept at its measured frequencies.
    turns : int
        One alone, the rest with the neighbours.
    kept : Choices
        Kinds of camera pixels from a look at some of the photos, by `choose_kinds`.
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
    return assemble(*_take_turns(problem, turns, kept, report), far)


def choose_kinds(
    measurements: Measurements,
    correspondence: Floats,
    window: int,
    *,
    device: Device = "cpu",
    progress: Callable[[float], None] | None = None,
) -> Choices:
    """Choose what kind each camera pixel is by some photos, for an estimate from more of them.

    Parameters and errors are those of `estimate_jointly`.

    Returns
    -------
    Choices
        One for each turn.
    """
    report = progress or (lambda _share: None)
    problem = lay_out(measurements, correspondence, window, device)
    _, rows = _take_turns(problem, TURNS, (), report)
    return rows.choices


def _take_turns(
    problem: Problem, turns: int, kept: Choices, progress: Callable[[float], None]
) -> tuple[Problem, Rows]:
    rows = None
    for turn, settled in zip_longest(range(turns), kept[:turns]):

        def report(share: float, turn: int = turn) -> None:
            progress((turn + share) / turns)

        rows = take_turn(problem, rows, report, settled)
        whole = problem.whole._replace(correspondence=_moved(problem, rows))
        problem = problem._replace(whole=whole)
    assert rows is not None
    return problem, rows


def _moved(problem: Problem, rows: Rows) -> Floats:
    """Move q by what it was found to be off, but no further than its rounding allows."""
    xp = namespace(rows.shared)
    shared = xp.astype(rows.shared, xp.float64)
    direct = shared[..., 1]
    energy = xp.clip(xp.sum(direct**2, axis=1), min=float(np.finfo(np.float32).tiny))
    off = xp.sum(shared[..., 2:KEPT] * direct[..., None], axis=1) / energy[:, None]
    off = xp.where((xp.sum(direct, axis=1) > 0)[:, None], xp.clip(off, -FURTHEST, FURTHEST), 0.0)
    whole, centres = problem.whole, xp.astype(problem.whole.centres, xp.float64)
    last = beside(np.array(problem.measurements.projector) - 1.0, shared)
    lowest, highest = xp.clip(centres - HALF, min=0.0), xp.minimum(centres + HALF, last)
    moved: Floats = xp.maximum(xp.minimum(whole.correspondence + off, highest), lowest)
    return moved
