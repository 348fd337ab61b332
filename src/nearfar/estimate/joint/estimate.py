"""The joint estimate: direct, near and far in one model, each camera pixel by its own kind.

First every camera pixel chooses a kind and a strength by its own photos and takes the posterior
mean. Then, in turns, each starts from what its neighbours expect and estimates what differs.
"""

from collections.abc import Callable

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.errors import InputError
from nearfar.estimate.joint.assemble import assemble
from nearfar.estimate.joint.nuisance import KEPT
from nearfar.estimate.joint.problem import Problem, Rows, lay_out
from nearfar.estimate.joint.turn import take_turn
from nearfar.illumination.frequencies import DC
from nearfar.photometry.measurements import Measurements
from nearfar.transport.model import Transport

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
    progress : callable, optional
        Called with the share done.

    Returns
    -------
    Transport

    Raises
    ------
    InputError
        If white or everything else is missing.
    """
    frequencies = [k for k in measurements.basis.frequencies if k != DC]
    if len(frequencies) == len(measurements.basis.frequencies) or not frequencies:
        raise InputError(
            "these measurements lack white, or all but white: plan with --photos, or --near and "
            "--far."
        )
    problem = lay_out(measurements, correspondence, window, frequencies)
    rows = None
    for turn in range(turns):

        def report(share: float, turn: int = turn) -> None:
            if progress is not None:
                progress((turn + share) / turns)

        rows = take_turn(problem, rows, report)
        whole = problem.whole._replace(correspondence=_moved(problem, rows))
        problem = problem._replace(whole=whole)
    assert rows is not None
    return assemble(problem, rows, far)


def _moved(problem: Problem, rows: Rows) -> Floats:
    """Move q by what it was found to be off, but no further than its rounding allows."""
    direct = rows.shared[..., 1].astype(np.float64)
    energy = np.maximum(np.sum(direct**2, axis=1), np.finfo(np.float32).tiny)
    off = np.sum(rows.shared[..., 2:KEPT] * direct[..., None], axis=1) / energy[:, None]
    off = np.where((direct.sum(axis=1) > 0)[:, None], np.clip(off, -FURTHEST, FURTHEST), 0.0)
    whole, last = problem.whole, np.array(problem.measurements.projector) - 1
    lowest = np.maximum(whole.centres - HALF, 0)
    return np.clip(whole.correspondence + off, lowest, np.minimum(whole.centres + HALF, last))
