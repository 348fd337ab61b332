"""The codes of a capture's patterns, and the sequences of its camera pixels."""

from collections.abc import Sequence
from math import ceil
from typing import NamedTuple

import numpy as np
from scipy.interpolate import make_interp_spline

from nearfar.arrays import Booleans, Floats, Integers, Size
from nearfar.capture import Capture
from nearfar.correspondence.codes import MOST_CODE_VALUES, Codes, prepare_codes
from nearfar.errors import InputError
from nearfar.plan import Pattern
from nearfar.plan.patterns import Shown
from nearfar.plan.recognition.contents import AnyPicture, Fringes
from nearfar.progress import Report

# Number of the group of patterns of two levels.
TWO_LEVELS = 2
# Places that camera pixels are compared with one by one, at most.
MOST_PLACES = 2**16
# Places in a footprint that are compared, down and across.
PLACES_IN_FOOTPRINT = 4
# Levels that differ by less are the same.
SAME_LEVEL = 1e-6


class Seen(NamedTuple):
    """How camera pixels see the levels of patterns.

    Attributes
    ----------
    exponent : float
        Power that levels are raised to, but those of patterns with two.
    heights, widths : tuple of float
        Sizes of the footprints of camera pixels on the projector, in its pixels; 0 is a single
        place. As many heights as widths, the smallest first.
    """

    exponent: float = 1.0
    heights: tuple[float, ...] = (0.0,)
    widths: tuple[float, ...] = (0.0,)


AS_IN_THE_FILE = Seen()


class PatternLevels(NamedTuple):
    """The patterns of a capture, as levels of each colour that tells places.

    Attributes
    ----------
    has_colours : bool
        Whether colours tell places separately; then a photo counts as three, one for each channel.
    along : ndarray of bool, shape (photos, 2)
        Whether a pattern differs from row to row, and from column to column.
    rows, columns : ndarray, shapes (photos, Py) and (photos, Px)
        Levels of the first column and the first row.
    groups : ndarray of int, shape (photos,)
        Patterns of one number share an offset and a direct light.
    whole : WholePatterns or None
        All levels, if some patterns differ along both axes and there are few enough places to
        compare camera pixels with each.
    """

    has_colours: bool
    along: Booleans
    rows: Floats
    columns: Floats
    groups: Integers
    whole: "WholePatterns | None"


class WholePatterns(NamedTuple):
    """The levels of all patterns, once for each run of rows and columns that show the same.

    Attributes
    ----------
    levels : ndarray, shape (photos, rows, columns)
    rows, columns : ndarray of int
        First row and column of each run.
    """

    levels: Floats
    rows: Integers
    columns: Integers


class Telling(NamedTuple):
    """Photos that tell a place, along one axis or along both.

    Attributes
    ----------
    axes : tuple of int
    photos : ndarray of int
    codes : list of Codes
        Of each size of the footprints of camera pixels.
    """

    axes: tuple[int, ...]
    photos: Integers
    codes: list[Codes]


def read_levels(capture: Capture, progress: Report) -> PatternLevels:
    """Read all patterns, one after the other."""
    shown, projector = capture.shown, capture.plan.projector
    has_colours = shown is not None and shown.ndim == 4 and capture.channels == 3
    along, rows, columns, groups = [], [], [], []
    changes = tuple(np.zeros(side, dtype=bool) for side in projector)
    count = len(capture.plan.patterns)
    for number in range(count):
        for level in _levels(capture, number, has_colours=has_colours):
            along.append([np.ptp(level, axis=axis).max() > SAME_LEVEL for axis in (0, 1)])
            rows.append(level[:, 0])
            columns.append(level[0])
            groups.append(_group(capture.plan.patterns[number]))
            for axis, change in enumerate(changes):
                moved = np.abs(np.diff(level, axis=axis)) > SAME_LEVEL
                change[1:] |= moved.any(axis=1 - axis)
        progress("patterns", (number + 1) / count)
    whole = None
    lines = [np.flatnonzero(change | (np.arange(len(change)) == 0)) for change in changes]
    if np.array(along).all(axis=1).any() and len(lines[0]) * len(lines[1]) <= MOST_PLACES:
        whole = WholePatterns(_thinned(capture, lines, has_colours=has_colours), *lines)
    return PatternLevels(
        has_colours, np.array(along), np.array(rows), np.array(columns), np.array(groups), whole
    )


def _thinned(capture: Capture, lines: Sequence[Integers], *, has_colours: bool) -> Floats:
    """Return all levels at some rows and columns, (photos, rows, columns)."""
    return np.concatenate(
        [
            _levels(capture, number, has_colours=has_colours)[:, lines[0][:, None], lines[1]]
            for number in range(len(capture.plan.patterns))
        ]
    )


def _group(pattern: Pattern) -> int:
    """Return a number that patterns of as many levels share: fringes, pictures, two levels."""
    content = pattern.content if isinstance(pattern, Shown) else None
    kinds = enumerate((Fringes, AnyPicture))
    return next((i for i, kind in kinds if isinstance(content, kind)), TWO_LEVELS)


def _levels(capture: Capture, number: int, *, has_colours: bool) -> Floats:
    """Return the levels of a pattern, (colours, Py, Px)."""
    pattern = capture.pattern(number)
    colours = pattern[..., None] if pattern.ndim == 2 else pattern
    if has_colours:
        return np.array(np.moveaxis(np.broadcast_to(colours, (*colours.shape[:2], 3)), -1, 0))
    return np.array(colours.mean(axis=-1)[None])


def find_telling(
    capture: Capture, patterns: PatternLevels, seen: Seen = AS_IN_THE_FILE
) -> list[Telling]:
    """Return the photos that tell each axis by themselves, or all, which tell both.

    All are used as soon as some differ along both axes, if there are few enough places.

    The patterns are taken as camera pixels see them.

    Raises
    ------
    InputError
        If there are none.
    """
    if patterns.whole is not None:
        return [_telling_both(capture.plan.projector, patterns, patterns.whole, seen)]
    found: list[Telling] = []
    reasons: list[str] = []
    for axis, lines in enumerate((patterns.rows, patterns.columns)):
        is_uniform = ~patterns.along.any(axis=1)
        is_mine = patterns.along[:, axis] & ~patterns.along[:, 1 - axis]
        photos = np.flatnonzero(is_mine | is_uniform)
        if is_mine.any():
            shaped = lines[photos][:, :, None] if axis == 0 else lines[photos][:, None, :]
            try:
                found.append(
                    Telling((axis,), photos, _codes(shaped, patterns.groups[photos], seen))
                )
            except InputError as error:
                reasons.append(str(error))
    if len(found) < 2 and patterns.along.all(axis=1).any():
        raise InputError(
            f"patterns of {capture.plan.projector} that differ along both axes are too many to "
            f"compare every camera pixel with: give patterns of larger blocks, or Gray code or "
            f"fringes of rows and of columns."
        )
    if not found:
        raise InputError(reasons[0] if reasons else "all patterns are the same everywhere.")
    return found


def _telling_both(
    projector: Size, patterns: PatternLevels, whole: "WholePatterns", seen: Seen
) -> Telling:
    """Return all photos, which tell both axes together."""
    lines = (whole.rows, whole.columns)
    levels = whole.levels
    if levels.shape[1:] != projector:
        # Blocks of several pixels are wider than most footprints.
        seen = Seen(seen.exponent)
    ends = (np.append(first[1:], side) for first, side in zip(lines, projector, strict=True))
    down, across = (0.5 * (a + b - 1) for a, b in zip(lines, ends, strict=True))
    codes = [each._replace(places=(down, across)) for each in _codes(levels, patterns.groups, seen)]
    return Telling((0, 1), np.arange(len(levels)), codes)


def _codes(levels: Floats, groups: Integers, seen: Seen) -> list[Codes]:
    """Return the codes of patterns (photos, down, across) for each size of footprints."""
    if seen.exponent != 1.0:
        powers = np.where(groups == TWO_LEVELS, 1.0, seen.exponent).astype(np.float32)
        levels = levels ** powers[:, None, None]
    most = max(1, MOST_CODE_VALUES // levels.size)
    sizes = dict.fromkeys(
        (height if levels.shape[1] > 1 else 0.0, width if levels.shape[2] > 1 else 0.0)
        for height, width in zip(seen.heights, seen.widths, strict=True)
    )
    return [
        prepare_codes(
            _averaged(_averaged(levels, height, 1), width, 2),
            groups,
            # Means change by little from one of these places to the next.
            (max(1, int(height / PLACES_IN_FOOTPRINT)), max(1, int(width / PLACES_IN_FOOTPRINT))),
        )
        for height, width in list(sizes)[:most]
    ]


def _averaged(levels: Floats, size: float, axis: int) -> Floats:
    """Return the means of levels over a size in pixels along one axis."""
    if not size:
        return levels
    side, before = levels.shape[axis], ceil(size)
    padding = [(before, before) if axis == other else (0, 0) for other in range(levels.ndim)]
    summed = np.cumsum(np.pad(levels, padding, mode="edge"), axis=axis, dtype=np.float64)
    # The sum up to place x, its pixel's share included, is at x + 1/2.
    sums = make_interp_spline(np.arange(side + 2 * before) + 0.5, summed, k=1, axis=axis)
    middle = np.arange(side) + before
    found = (sums(middle + size / 2) - sums(middle - size / 2)) / size
    return np.asarray(found, dtype=np.float32)


def read_sequences(capture: Capture, patterns: PatternLevels, rows: slice) -> Floats:
    """Return the sequence of each camera pixel of some rows, (C, photos)."""
    photos = capture.read(slice(None), rows)
    if patterns.has_colours:
        # Colours of the scene scale each channel; only how levels change tells a place.
        deviations = photos.std(axis=0)
        scale = deviations.mean(axis=-1, keepdims=True) / np.maximum(deviations, SAME_LEVEL)
        sequences = np.moveaxis(photos * scale, -1, 1)
    else:
        sequences = photos.mean(axis=-1)
    return np.ascontiguousarray(sequences.reshape(len(patterns.along), -1).T)
