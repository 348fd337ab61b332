"""The codes of a capture's patterns, and the sequences of its camera pixels."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter

from nearfar.arrays import Booleans, Floats, Integers, Size
from nearfar.capture import Capture
from nearfar.correspondence.codes import Codes, prepare_codes
from nearfar.errors import InputError
from nearfar.plan import Pattern
from nearfar.plan.patterns import Shown
from nearfar.plan.recognition.contents import AnyPicture, Fringes
from nearfar.progress import Report

# Number of the group of patterns of two levels.
TWO_LEVELS = 2
# Places that camera pixels are compared with one by one, at most.
MOST_PLACES = 2**16
# Levels that differ by less are the same.
SAME_LEVEL = 1e-6


class Display(NamedTuple):
    """How a projector shows patterns, and a camera sees them.

    Attributes
    ----------
    exponent : float
        Power that levels are raised to, but those of patterns with two.
    blur : float
        Standard deviation in projector pixels.
    """

    exponent: float
    blur: float


AS_IN_THE_FILE = Display(1.0, 0.0)


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
    """Photos that tell a place, along one axis or along both, and their codes."""

    axes: tuple[int, ...]
    photos: Integers
    codes: Codes


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
    capture: Capture, patterns: PatternLevels, display: Display = AS_IN_THE_FILE
) -> list[Telling]:
    """Return the photos that tell each axis by themselves, or all, which tell both.

    All are used as soon as some differ along both axes, if there are few enough places.

    The patterns are taken as the display shows them.

    Raises
    ------
    InputError
        If there are none.
    """
    if patterns.whole is not None:
        return [_telling_both(capture.plan.projector, patterns, patterns.whole, display)]
    found: list[Telling] = []
    reasons: list[str] = []
    for axis, lines in enumerate((patterns.rows, patterns.columns)):
        is_uniform = ~patterns.along.any(axis=1)
        is_mine = patterns.along[:, axis] & ~patterns.along[:, 1 - axis]
        photos = np.flatnonzero(is_mine | is_uniform)
        if is_mine.any():
            shaped = lines[photos][:, :, None] if axis == 0 else lines[photos][:, None, :]
            levels = _displayed(shaped, patterns.groups[photos], display)
            try:
                found.append(
                    Telling((axis,), photos, prepare_codes(levels, patterns.groups[photos]))
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
    projector: Size, patterns: PatternLevels, whole: "WholePatterns", display: Display
) -> Telling:
    """Return all photos, which tell both axes together."""
    lines = (whole.rows, whole.columns)
    levels = whole.levels
    if levels.shape[1:] != projector:
        # Blocks of several pixels are wider than any blur that is tried.
        display = display._replace(blur=0.0)
    codes = prepare_codes(_displayed(levels, patterns.groups, display), patterns.groups)
    ends = (np.append(first[1:], side) for first, side in zip(lines, projector, strict=True))
    down, across = (0.5 * (a + b - 1) for a, b in zip(lines, ends, strict=True))
    codes = codes._replace(places=(down, across))
    return Telling((0, 1), np.arange(len(levels)), codes)


def _displayed(levels: Floats, groups: Integers, display: Display) -> Floats:
    """Return patterns (photos, down, across) as a display shows them."""
    if display.exponent != 1.0:
        powers = np.where(groups == TWO_LEVELS, 1.0, display.exponent).astype(np.float32)
        levels = levels ** powers[:, None, None]
    if display.blur:
        deviations = [0.0, *(display.blur if side > 1 else 0.0 for side in levels.shape[1:])]
        levels = gaussian_filter(levels, deviations, mode="nearest")
    return levels


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
