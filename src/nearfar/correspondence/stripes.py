"""Correspondence by black stripes (section 5.1), robust under global illumination.

A black stripe removes the light of its row or column of projector pixels: the photos measure the
marginals of every row t. Direct light is a peak of one or two pixels on such a marginal; near- and
far-range light are smooth below it, and a second difference removes them.

Index convention: c runs over camera pixels, s over the stripes of one axis.
"""

from collections.abc import Callable, Sequence
from typing import Literal, NamedTuple

import numpy as np

from nearfar.arrays import Floats, Integers, Size, blocks
from nearfar.correspondence.methods import CorrespondenceMethod
from nearfar.correspondence.normal import normal_cdf
from nearfar.correspondence.result import Correspondence
from nearfar.errors import InputError
from nearfar.photometry.measurements import Measurements
from nearfar.photometry.photos import PHOTOS_AT_ONCE, Photos, size_of_rows
from nearfar.plan import Plan, Stripe

StripeKind = Literal["black row", "black column"]
# In the order of the axes, y before x.
KINDS: tuple[StripeKind, StripeKind] = ("black row", "black column")
# Values of photos whose peaks are found at once.
VALUES_AT_ONCE = 2**20
# Distance of the pixels, on both sides, that a peak is compared with.
BACKGROUND_REACH = 2
# Stripes away from the peak that are needed to estimate its noise.
FEWEST_FOR_NOISE = 3
# Confidence at which direct light is removed as seen: a false alarm of noise in a million.
LEAST_CONFIDENCE = 1 - 1e-6
# Standard deviations by which a second pixel must stand out to share the direct light.
LEAST_SECOND_DEVIATIONS = 4.0
# Share of a camera pixel's white below which a peak may be of near-range light.
LEAST_DIRECT_SHARE = 0.04
# Largest ratio of the direct light that the two axes measure, which should be the same.
LARGEST_STRENGTH_RATIO = 3.0


class _Axis(NamedTuple):
    """Measurements of one axis at every camera pixel, each of shape (C,)."""

    place: Floats
    strength: Floats
    deviations: Floats
    share: Floats


def stripes(projector: Size) -> tuple[Stripe, ...]:
    """Return a black stripe on each row, then on each column: Py + Px patterns (section 5.1).

    A single row, or column, has none: it would be all black.
    """
    return tuple(
        Stripe(kind=kind, index=index)
        for kind, side in _sides(projector).items()
        for index in range(side)
    )


def has_stripes(plan: Plan) -> bool:
    """Return whether a plan holds a stripe on every row and every column."""
    sides = _sides(plan.projector)
    return bool(sides) and all(
        set(range(side)) <= _numbers(plan, kind).keys() for kind, side in sides.items()
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
    found: dict[StripeKind, _Axis] = {}
    read = 0
    false_alarm: Floats = np.zeros(camera.pixels)
    for kind, side in _sides(plan.projector).items():
        found[kind] = _axis(photos, kind, rows, progress, read)
        read += side
        false_alarm = false_alarm + side * normal_cdf(-found[kind].deviations)
    confidence = 1.0 - np.minimum(1.0, false_alarm)
    # Across a single row there is nothing to find: its place is 0.
    along = next(iter(found.values()))
    down, across = (
        found.get(kind, along._replace(place=np.zeros(camera.pixels))) for kind in KINDS
    )
    strong, weak = (
        np.maximum(down.strength, across.strength),
        np.minimum(down.strength, across.strength),
    )
    lit = (
        (confidence >= LEAST_CONFIDENCE)
        & (strong <= LARGEST_STRENGTH_RATIO * weak)
        & (np.minimum(down.share, across.share) >= LEAST_DIRECT_SHARE)
    )
    q = np.stack([down.place, across.place], axis=-1)
    q[~lit] = np.nan
    return Correspondence(
        q.reshape(*camera, 2).astype(np.float32),
        np.asarray(confidence, dtype=np.float32).reshape(camera),
    )


def _sides(projector: Size) -> dict[StripeKind, int]:
    """Return the kinds of stripes that a projector has, and their numbers."""
    return {kind: side for kind, side in zip(KINDS, projector, strict=True) if side > 1}


def _axis(
    photos: Photos,
    kind: str,
    rows: slice,
    progress: Callable[[int], None] | None,
    before: int = 0,
) -> _Axis:
    numbers = _numbers(photos.plan, kind)
    values = _summed(photos, [numbers[s] for s in sorted(numbers)], rows)
    if progress is not None:
        progress(before + len(numbers))
    # The temporary arrays of all camera pixels would take several times as much as the photos.
    parts = [
        _peak(*_marginal(values[:, pixels]))
        for pixels in blocks(values.shape[1], VALUES_AT_ONCE // len(values))
    ]
    return _Axis(*(np.concatenate(values) for values in zip(*parts, strict=True)))


def _numbers(plan: Plan, kind: str) -> dict[int, int]:
    """Return photo numbers by row or column."""
    return {
        pattern.index: i
        for i, pattern in enumerate(plan.patterns)
        if isinstance(pattern, Stripe) and pattern.kind == kind
    }


def _summed(photos: Photos, numbers: Sequence[int], rows: slice) -> Floats:
    """Return photos summed over channels, (s, C), float32.

    As they are, which is the best sum where shot noise dominates.
    """
    values = np.empty((len(numbers), size_of_rows(photos, rows).pixels), dtype=np.float32)
    for batch in blocks(len(numbers), PHOTOS_AT_ONCE):
        read = photos.read(numbers[batch], rows).sum(axis=-1)
        values[batch] = read.reshape(len(read), -1)
    return values


def _marginal(values: Floats) -> tuple[Floats, Floats]:
    """Return the light that each stripe removes, (C, s), and the photo without stripes, (C,)."""
    values = np.ascontiguousarray(values.T)
    # Most stripes do not touch a pixel's direct light: their median is the photo without stripes.
    white = np.median(values, axis=1) if values.shape[1] > 2 else values.max(axis=1)
    return white[:, None] - values, white


def _deviation(curvature: Floats, peak: Integers) -> Floats:
    """Return the deviation of each pixel's second differences away from its peak, (C,)."""
    length = curvature.shape[1]
    # The peak is in the second differences of pixels up to this distance.
    away = np.abs(np.arange(length) - peak[:, None]) > BACKGROUND_REACH + 1
    enough = away.sum(axis=1) >= FEWEST_FOR_NOISE
    kept = np.where(away | ~enough[:, None], curvature, np.nan)
    spread = np.abs(kept - np.nanmedian(kept, axis=1)[:, None])
    return np.asarray(1.4826 * np.nanmedian(spread, axis=1) + 1e-12)


def _peak(removed: Floats, white: Floats) -> _Axis:
    pixels, length = removed.shape
    number = np.arange(pixels)
    # At the border the only neighbour is used for both sides.
    place = np.arange(length)
    left = np.where(
        place >= BACKGROUND_REACH,
        place - BACKGROUND_REACH,
        np.minimum(place + BACKGROUND_REACH, length - 1),
    )
    right = np.where(
        place < length - BACKGROUND_REACH,
        place + BACKGROUND_REACH,
        np.maximum(place - BACKGROUND_REACH, 0),
    )
    curvature = removed - 0.5 * (removed[:, left] + removed[:, right])
    peak = np.argmax(curvature, axis=1)
    deviation = _deviation(curvature, peak)
    noise = deviation / np.sqrt(1.5)

    # Beyond the border, the pixel past the other neighbour is used: it has no direct light.
    before = removed[number, np.where(peak > 0, peak - 1, np.minimum(BACKGROUND_REACH, length - 1))]
    last = length - 1
    after = removed[number, np.where(peak < last, peak + 1, np.maximum(last - BACKGROUND_REACH, 0))]
    # Near-range light is the same on both sides, so their difference is direct light.
    second = np.abs(after - before)
    second = np.where(second > LEAST_SECOND_DEVIATIONS * np.sqrt(2.0) * noise, second, 0.0)
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
