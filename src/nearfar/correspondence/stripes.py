"""Correspondence by black stripes (section 5.1), robust under global illumination.

A black stripe takes away what its row or column of projector pixels gave: the photos tell the
marginals of every row t. Direct light is a peak of one or two pixels on that marginal; near- and
far-range light are smooth under it and fall out of a second difference.

Index convention: c runs over camera pixels, s over the stripes of one axis.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, Integers, Size
from nearfar.correspondence.methods import CorrespondenceMethod
from nearfar.correspondence.normal import normal_cdf
from nearfar.correspondence.result import Correspondence
from nearfar.errors import InputError
from nearfar.photometry.measurements import Measurements
from nearfar.photometry.photos import BATCH, Photos, size_of_rows
from nearfar.plan import Plan, Stripe

# A peak has no background closer than this to it.
REACH = 2
# Stripes away from the peak that are needed to tell its noise.
FEWEST = 3
# Confidence at which direct light is taken as seen: a false alarm of noise in a million.
SURE = 1 - 1e-6
# A second pixel shares the direct light only if it stands out by as many deviations.
SHARED = 4.0
# Direct light under this share of a camera pixel's white is near-range light's own peak.
LEAST_SHARE = 0.04
# The two axes see the same direct light; they may differ by this factor.
AGREEMENT = 3.0


class _Axis(NamedTuple):
    """One axis's answer for every camera pixel, each of shape (C,)."""

    place: Floats
    strength: Floats
    deviations: Floats
    share: Floats


def stripes(projector: Size) -> tuple[Stripe, ...]:
    """Return a black stripe on each row, then on each column: Py + Px patterns (section 5.1)."""
    return (
        *(Stripe(kind="black row", index=y) for y in range(projector.height)),
        *(Stripe(kind="black column", index=x) for x in range(projector.width)),
    )


def has_stripes(plan: Plan) -> bool:
    """Return whether a plan holds a stripe on every row and every column."""
    return all(
        _numbers(plan, kind).keys() == set(range(side))
        for kind, side in zip(("black row", "black column"), plan.projector, strict=True)
    )


def correspond_by_stripes(
    photos: Photos, rows: slice | None = None, progress: Callable[[int], None] | None = None
) -> Correspondence:
    """Find q(c) from photos of black stripes.

    Parameters
    ----------
    photos : Photos
        A capture whose plan holds stripes.
    rows : slice, optional
        Rows of the camera; all by default.
    progress : callable, optional
        Called with the number of photos read so far.

    Returns
    -------
    Correspondence

    Raises
    ------
    InputError
        If the plan holds no stripes.
    """
    plan = photos.plan
    if not has_stripes(plan):
        raise InputError(
            "the plan of this capture has no stripes: give the correspondence with "
            "`correspondence`, or plan with `correspondence='stripes'`."
        )
    rows = slice(0, photos.camera.height) if rows is None else rows
    camera = size_of_rows(photos, rows)
    down = _axis(photos, "black row", rows, progress)
    across = _axis(photos, "black column", rows, progress)

    false_alarm: Floats = np.zeros(camera.pixels)
    for axis, length in ((down, plan.projector.height), (across, plan.projector.width)):
        false_alarm = false_alarm + length * normal_cdf(-axis.deviations)
    confidence = 1.0 - np.minimum(1.0, false_alarm)
    strong, weak = (
        np.maximum(down.strength, across.strength),
        np.minimum(down.strength, across.strength),
    )
    lit = (
        (confidence >= SURE)
        & (strong <= AGREEMENT * weak)
        & (np.minimum(down.share, across.share) >= LEAST_SHARE)
    )
    q = np.stack([down.place, across.place], axis=-1)
    q[~lit] = np.nan
    return Correspondence(
        q.reshape(*camera, 2).astype(np.float32),
        np.asarray(confidence, dtype=np.float32).reshape(camera),
    )


def _axis(photos: Photos, kind: str, rows: slice, progress: Callable[[int], None] | None) -> _Axis:
    numbers = _numbers(photos.plan, kind)
    taken, white = _marginal(photos, [numbers[s] for s in sorted(numbers)], rows)
    if progress is not None:
        progress(len(numbers))
    return _peak(taken, white)


def _numbers(plan: Plan, kind: str) -> dict[int, int]:
    """Photo numbers by row or column."""
    return {
        pattern.index: i
        for i, pattern in enumerate(plan.patterns)
        if isinstance(pattern, Stripe) and pattern.kind == kind
    }


def _marginal(photos: Photos, numbers: Sequence[int], rows: slice) -> tuple[Floats, Floats]:
    """Light that each stripe takes away, (C, s), and the photo without stripes, (C,).

    Channels are weighed by their light: where shot noise rules, that is the best sum.
    """
    stack = [
        photos.read(numbers[start : start + BATCH], rows) for start in range(0, len(numbers), BATCH)
    ]
    shown = np.concatenate(stack).sum(axis=-1).reshape(len(numbers), -1).T
    # Most stripes leave a pixel's direct light alone: the median is the photo without stripes.
    white = np.median(shown, axis=1) if len(numbers) > 2 else shown.max(axis=1)
    return white[:, None] - shown, white


def _deviation(curvature: Floats, peak: Integers) -> Floats:
    """Scatter of what is no peak, (C,): the noise as each pixel's own stripes show it."""
    length = curvature.shape[1]
    # A peak bends the curve as far as two reaches of the second difference.
    away = np.abs(np.arange(length) - peak[:, None]) > REACH + 1
    enough = away.sum(axis=1) >= FEWEST
    kept = np.where(away | ~enough[:, None], curvature, np.nan)
    spread = np.abs(kept - np.nanmedian(kept, axis=1)[:, None])
    return np.asarray(1.4826 * np.nanmedian(spread, axis=1) + 1e-12)


def _peak(taken: Floats, white: Floats) -> _Axis:
    pixels, length = taken.shape
    number = np.arange(pixels)
    # At the border the one neighbour there is stands for both.
    place = np.arange(length)
    left = np.where(place >= REACH, place - REACH, np.minimum(place + REACH, length - 1))
    right = np.where(place < length - REACH, place + REACH, np.maximum(place - REACH, 0))
    curvature = taken - 0.5 * (taken[:, left] + taken[:, right])
    peak = np.argmax(curvature, axis=1)
    deviation = _deviation(curvature, peak)
    noise = deviation / np.sqrt(1.5)

    # Beyond the border stands what lies past the neighbour on the other side: no direct light.
    before = taken[number, np.where(peak > 0, peak - 1, np.minimum(REACH, length - 1))]
    last = length - 1
    after = taken[number, np.where(peak < last, peak + 1, np.maximum(last - REACH, 0))]
    # Near-range light is the same to both sides, so the difference is direct light's own.
    second = np.abs(after - before)
    second = np.where(second > SHARED * np.sqrt(2.0) * noise, second, 0.0)
    first = curvature[number, peak]
    side = np.where(after > before, 1.0, -1.0)
    total = first + second
    between = peak + side * second / np.maximum(total, 1e-12)
    return _Axis(
        place=np.clip(np.where(total > 0, between, peak), 0, last),
        strength=total,
        deviations=first / deviation,
        share=total / np.maximum(white, 1e-12),
    )


def _find(
    photos: Photos,
    rows: slice,
    measure: Callable[[], Measurements],
    progress: Callable[[int], None] | None = None,
) -> Correspondence:
    return correspond_by_stripes(photos, rows, progress)


STRIPES = CorrespondenceMethod(patterns=stripes, serves=has_stripes, find=_find)
