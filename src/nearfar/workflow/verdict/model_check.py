"""The verdict on a model check: good, doubtful or wrong, and why."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from nearfar.transport.verdict import Grade
from nearfar.workflow.check import ModelCheck
from nearfar.workflow.conditioning import Conditioning

# The best that the model can do without noise, in dB, under pictures and in the median row: from
# the first on, errors of relit pictures are hardly seen (2 %); below the second, they are plain
# (6 %). Rows weigh all lights alike, so that a pattern of single pixels meets their error.
GOOD_DECIBELS, DOUBTFUL_DECIBELS = 35.0, 25.0
GOOD_ROW_DECIBELS, DOUBTFUL_ROW_DECIBELS = 25.0, 15.0
# What is named as a cause: shares of energy outside the window or beyond the far band, of direct
# light that the checkerboard mistakes, and of camera pixels without direct light.
NEAR_OUTSIDE = 0.02
FAR_BEYOND = 0.05
CHECKERBOARD = 0.1
UNLIT = 0.1


@dataclass(frozen=True)
class CheckVerdict:
    """Whether the model suits a scene.

    Attributes
    ----------
    grade : {"good", "doubtful", "wrong"}
    says : str
        What the grade means for this scene, a sentence.
    causes : tuple of str
        Departures from the model, and what to do about each, a sentence each, the largest first.
    """

    grade: Grade
    says: str
    causes: tuple[str, ...]


def judge_check(check: ModelCheck) -> CheckVerdict:
    """Judge a check by the best that the model can do on the scene.

    Parameters
    ----------
    check : ModelCheck

    Returns
    -------
    CheckVerdict
    """
    pictures, rows = check.best_pictures, check.best_rows
    grade: Grade
    if pictures >= GOOD_DECIBELS and rows >= GOOD_ROW_DECIBELS:
        grade, suits = "good", "suits this scene"
    elif pictures >= DOUBTFUL_DECIBELS and rows >= DOUBTFUL_ROW_DECIBELS:
        grade, suits = "doubtful", "holds this scene in part"
    else:
        grade, suits = "wrong", "does not hold this scene"
    says = (
        f"The model with W = {check.window} and a far band of {check.far} {suits}: at its best, "
        f"without noise, pictures are off by {_percent(pictures)}, and the light of single "
        f"projector pixels by {_percent(rows)}."
    )
    return CheckVerdict(grade, says, tuple(_causes(check)))


def _percent(decibels: float) -> str:
    """Write an SNR as the share of the light that it is off by."""
    return f"{10 ** (-decibels / 20):.2%}" if decibels > 40 else f"{10 ** (-decibels / 20):.1%}"


def _causes(check: ModelCheck) -> list[str]:
    beyond = check.far_beyond * (1 - check.far_beyond_in_window)
    found = [
        (
            (1 - check.lit) / UNLIT,
            f"{1 - check.lit:.0%} of the camera pixels see no direct light that stands out: their "
            f"light is held by the far band alone. A larger far band, or as many photos as "
            f"projector pixels, helps.",
        ),
        (
            beyond / FAR_BEYOND,
            f"{beyond:.0%} of the energy of F lies beyond the far band and outside the window, "
            f"where nothing holds it. A larger far band or a larger W helps.",
        ),
        (
            check.near_outside / NEAR_OUTSIDE,
            f"{check.near_outside:.0%} of the energy of N lies outside the window. A larger W "
            f"helps.",
        ),
    ]
    said = [sentence for size, sentence in sorted(found, reverse=True) if size > 1]
    board = float(np.hypot(check.checkerboard_near, check.checkerboard_far))
    if check.lit > 0 and board > CHECKERBOARD:
        said.append(
            f"N and F answer to the checkerboard with {board:.0%} of D's amplitude, by which the "
            f"paper's direct light is off; the joint estimate does not rely on it."
        )
    return said


def numbers_of(check: ModelCheck, condition: Conditioning) -> dict[str, Any]:
    """Return a check's numbers and its verdict as JSON holds them: all but its maps."""
    found = {
        name: value for name, value in vars(check).items() if not isinstance(value, np.ndarray)
    }
    for name in ("near_bandwidth", "far_bandwidth"):
        found[name] = {str(share): k for share, k in found[name].items()}
    verdict = judge_check(check)
    return found | {
        "far": list(check.far),
        "condition": vars(condition),
        "verdict": verdict.grade,
        "causes": list(verdict.causes),
    }


def describe_verdict(verdict: CheckVerdict) -> str:
    """Return the verdict in one line."""
    return f"{verdict.grade}: {' '.join([verdict.says, *verdict.causes])}"
