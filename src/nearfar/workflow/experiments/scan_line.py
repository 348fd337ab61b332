"""The components of a transport along a scan line (section 3.1 and figure 3).

Index convention: slices are [camera pixel, projector pixel] along one row of each.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats
from nearfar.callbacks import Report
from nearfar.illumination.frequencies import as_array, far_frequencies, near_frequencies
from nearfar.illumination.pictures import white
from nearfar.scenes.cache import cached_scene
from nearfar.workflow.check import check_model
from nearfar.workflow.conditioning import condition_near
from nearfar.workflow.experiments.acquired import Acquisition, thin
from nearfar.workflow.experiments.data import Data
from nearfar.workflow.verdict.model_check import numbers_of

# Singular values above this share of the largest of T count towards a rank.
RANK_TOLERANCE = 1e-3


@dataclass(frozen=True)
class Line:
    """Where to cut and which two camera pixels to look at, as shares of the camera's sides."""

    height: float
    columns: tuple[float, float]


# Through the candle's side and the cup: one camera pixel on each.
LINE = Line(0.75, (0.34, 0.67))


def components_along_a_line(case: Acquisition, report: Report) -> Data:
    """Cut a scene's exact transport along `LINE` and look at each component.

    Parameters
    ----------
    case : Acquisition
        With a coaxial camera as fine as the projector.
    report : callable
        Called with what is being done and the share done.

    Returns
    -------
    Data
        Arrays: ``T``, ``D``, ``N``, ``F`` slices (mean over channels) and ``T/singular`` and so
        on; ``columns``, the two camera pixels, and ``T/along`` and so on, their rows summed
        down the projector; ``picture/T`` and so on under white; the plan's frequencies.
        Numbers: ranks, bandwidths, and the model's check.
    """
    truth = cached_scene(case.scene, case.projector, progress=report)
    width = truth.camera.width
    y = int(LINE.height * truth.camera.height)
    pixels = slice(y * width, (y + 1) * width)
    line = slice(y * case.projector.width, (y + 1) * case.projector.width)
    parts = dict(zip("DNF", truth.component_rows(pixels), strict=True))
    cut = {name: rows.mean(axis=1)[:, line].astype(np.float64) for name, rows in parts.items()}
    cut = {"T": sum_of(list(cut.values())), **cut}
    singular = {name: np.linalg.svd(values, compute_uv=False) for name, values in cut.items()}
    strongest = singular["T"][0]
    shown = dict(zip("DNF", truth.component_pictures(white(case.projector)), strict=True))
    check = check_model(
        truth, case.window, case.far, progress=lambda _rows, share: report("model check", share)
    )
    condition = condition_near(case.projector, case.window, case.plan.dropped)
    arrays: dict[str, NDArray[Any]] = dict(cut)
    arrays |= {f"{name}/singular": values for name, values in singular.items()}
    arrays |= {f"picture/{name}": values for name, values in shown.items()}
    arrays["picture/T"] = sum_of(list(shown.values()))
    arrays["columns"] = columns = np.array([int(share * width) for share in LINE.columns])
    # Summed down the projector, a row holds the response to patterns that vary along the line
    # alone.
    arrays |= {
        f"{name}/along": rows[columns].mean(axis=1).reshape(len(columns), *case.projector).sum(1)
        for name, rows in {**parts, "T": sum_of(list(parts.values()))}.items()
    }
    arrays["near"] = as_array(near_frequencies(case.window, case.plan.dropped))
    arrays["far"] = as_array(far_frequencies(case.far, case.projector))
    numbers = {
        "scene": case.scene,
        "projector": list(case.projector),
        "window": case.window,
        "far": list(case.far),
        "line": y,
        "rank_above": RANK_TOLERANCE,
        "ranks": {
            name: int(np.sum(values > RANK_TOLERANCE * strongest))
            for name, values in singular.items()
        },
        "energy": {name: float(np.sum(values**2)) for name, values in singular.items()},
        # Cycles along the line, as the paper counts k.
        "k_far": case.far.width // 2,
        "k_near": check.k_near * case.projector.width,
        "held": 1.0 - check.near_beyond,
        "check": numbers_of(check, condition),
    }
    return Data({name: thin(values) for name, values in arrays.items()}, numbers)


def sum_of(parts: list[Floats]) -> Floats:
    """Add up pictures or slices."""
    return np.asarray(np.sum(parts, axis=0))
