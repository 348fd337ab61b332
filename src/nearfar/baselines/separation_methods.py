"""Methods of separating direct from global light: their patterns, and the separation itself."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size
from nearfar.baselines.separation import (
    Separation,
    separate_by_extremes,
    separate_by_pairs,
    separate_by_phase,
)
from nearfar.baselines.separation_patterns import (
    DEFAULT_PERIOD,
    DEFAULT_SHIFTS,
    DEFAULT_SIDE,
    checkerboards,
    count_checkerboards,
    count_sinusoids,
    default_step,
    sinusoids,
)


@dataclass(frozen=True, eq=False)
class Method:
    """Patterns, and how their photos are separated.

    Attributes
    ----------
    settings : mapping
        The pattern and its numbers, ready for JSON.
    count : int, optional
        Number of patterns, where it is known.
    groups : int
        Groups of patterns that each sum to the same grey; 1 where none are known.
    draw : callable, optional
        From the projector's size to the patterns, (n, Py, Px), uint8; None where the patterns
        are not known.
    separate : callable
        From photos and black level to their separation.
    """

    settings: Mapping[str, Any]
    count: int | None
    groups: int
    draw: Callable[[Size], NDArray[np.uint8]] | None
    separate: Callable[[Floats, float], Separation]


def by_checkerboards(side: int | None = None, step: int | None = None) -> Method:
    """Separate by shifted checkerboards; see `nearfar.baselines.separation_patterns`.

    Raises
    ------
    InputError
        If the step does not fit the side.
    """
    side = DEFAULT_SIDE if side is None else side
    step = default_step(side) if step is None else step
    count = count_checkerboards(side, step)
    return Method(
        {"pattern": "checkerboard", "side": side, "step": step},
        count,
        count // 2,
        lambda projector: checkerboards(projector, side, step),
        separate_by_pairs,
    )


def by_sinusoids(period: int | None = None, shifts: int | None = None) -> Method:
    """Separate by shifted sinusoids; see `nearfar.baselines.separation_patterns`.

    Raises
    ------
    InputError
        If there are too few shifts.
    """
    period = DEFAULT_PERIOD if period is None else period
    shifts = DEFAULT_SHIFTS if shifts is None else shifts
    return Method(
        {"pattern": "sinusoid", "period": period, "shifts": shifts},
        count_sinusoids(shifts),
        2,
        lambda projector: sinusoids(projector, period, shifts),
        lambda photos, level: separate_by_phase(photos, shifts, level),
    )


def by_any_patterns() -> Method:
    """Separate by the extremes of photos under half-lit patterns that are not known."""
    return Method({"pattern": "any"}, None, 1, None, separate_by_extremes)
