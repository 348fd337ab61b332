"""The codes of a capture's patterns, and the sequences of its camera pixels."""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter

from nearfar.arrays import Booleans, Floats, Integers
from nearfar.capture import Capture
from nearfar.correspondence.codes import Codes, prepare_codes
from nearfar.errors import InputError
from nearfar.plan import Pattern
from nearfar.plan.patterns import Shown
from nearfar.plan.recognition.contents import AnyPicture, Fringes
from nearfar.progress import Report

# Number of the group of patterns of two levels.
TWO_LEVELS = 2
# Projectors of at most as many pixels are compared with pixel by pixel.
PIXELS_OF_ALL_PATTERNS = 2**16
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
    """

    has_colours: bool
    along: Booleans
    rows: Floats
    columns: Floats
    groups: Integers


class Telling(NamedTuple):
    """Photos that tell a place, along one axis or along both, and their codes."""

    axes: tuple[int, ...]
    photos: Integers
    codes: Codes


def read_levels(capture: Capture, progress: Report) -> PatternLevels:
    """Read all patterns once, one after the other, and keep what those of one axis show."""
    shown = capture.shown
    has_colours = shown is not None and shown.ndim == 4 and capture.channels == 3
    along, rows, columns, groups = [], [], [], []
    count = len(capture.plan.patterns)
    for number in range(count):
        for level in _levels(capture, number, has_colours=has_colours):
            along.append([np.ptp(level, axis=axis).max() > SAME_LEVEL for axis in (0, 1)])
            rows.append(level[:, 0])
            columns.append(level[0])
            groups.append(_group(capture.plan.patterns[number]))
        progress("patterns", (number + 1) / count)
    return PatternLevels(
        has_colours, np.array(along), np.array(rows), np.array(columns), np.array(groups)
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

    On a small projector all are used as soon as some differ along both axes. On a large one they
    are only where the others do not tell both axes.

    The patterns are taken as the display shows them.

    Raises
    ------
    InputError
        If there are none.
    """
    has_both = bool(patterns.along.all(axis=1).any())
    if has_both and capture.plan.projector.pixels <= PIXELS_OF_ALL_PATTERNS:
        return [_telling_both(capture, patterns, display)]
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
    if len(found) < 2 and has_both:
        return [_telling_both(capture, patterns, display)]
    if not found:
        raise InputError(reasons[0] if reasons else "all patterns are the same everywhere.")
    return found


def _telling_both(capture: Capture, patterns: PatternLevels, display: Display) -> Telling:
    """Return all photos, which tell both axes together."""
    every = np.concatenate(
        [
            _levels(capture, number, has_colours=patterns.has_colours)
            for number in range(len(capture.plan.patterns))
        ]
    )
    every = _displayed(every, patterns.groups, display)
    return Telling((0, 1), np.arange(len(every)), prepare_codes(every, patterns.groups))


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
