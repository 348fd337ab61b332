"""Which photos of any patterns separate direct from global light, and which do not, and why.

A pattern serves if it is fine against how global light varies, and has fringes or two levels, both
of them on a fair share of the pixels. Fringes of one frequency at several phases and pairs of
inverses are solved for by least squares; patterns of two levels without inverses, such as shifted
checkerboards and random pixels, by each camera pixel's bright and dark photos.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter

from nearfar.arrays import Floats
from nearfar.errors import InputError
from nearfar.plan.recognition import Recognised
from nearfar.plan.recognition.contents import AnyPicture, Content, Fringes, Uniform

# Global light varies little over this share of the screen's side, and over so many pixels.
EVEN_SHARE = 1 / 6
FEWEST_EVEN_PIXELS = 3
# Share of a pattern's deviation that its mean over that many pixels may keep.
LARGEST_SLOW_SHARE = 0.35
# Share of the pixels that each of two levels has at least.
LEAST_LEVEL_SHARE = 0.2
# Contrast that a pattern has at least.
LEAST_CONTRAST = 0.1
# Periods up to so many times the finest are used; shorter than so many pixels, they blur.
PERIOD_RANGE = 2.0
SHORTEST_PERIOD = 3.0
# Fringes are of one frequency if they drift apart by fewer cycles on the screen.
SAME_CYCLES = 0.1
# Phases, in cycles, that are one.
SAME_PHASE = 0.02
FEWEST_PHASES = 3
# Patterns without inverses, of which each camera pixel needs bright and dark ones.
FEWEST_SHIFTED = 4

TOO_SLOW = "vary too slowly, so that global light varies with them"
COARSER = "are coarser than the finest"
OTHER_PERIOD = "are of another period"
TOO_FINE = "are so fine that they blur"
TOO_LITTLE_WHITE = "light, or leave dark, too few of the pixels"
TOO_FAINT = "have too little contrast"
TOO_FEW_PHASES = "have too few phases of their frequency"
NO_INVERSE = "have no inverse"
NO_KIND = "are neither fringes nor of two levels"


class Measured(NamedTuple):
    """A pattern in numbers.

    Attributes
    ----------
    number : int
    content : Content
    mean, lowest, highest : float
        Levels over the screen.
    period : float
        Pixels from one crest to the next, typically, along the axis where they are fewer.
    axes : tuple of bool
        Whether it varies from row to row, and from column to column.
    """

    number: int
    content: Content
    mean: float
    lowest: float
    highest: float
    period: float
    axes: tuple[bool, bool]


class Wave(NamedTuple):
    """Fringes of one frequency: their photos, and the phase of each at the screen's middle."""

    patterns: tuple[Measured, ...]
    phases: tuple[float, ...]  # cycles


class Pair(NamedTuple):
    """A pattern of two levels and its inverse."""

    pattern: Measured
    inverse: Measured


@dataclass(frozen=True)
class Choice:
    """Patterns that separate, and those that do not.

    Attributes
    ----------
    uniform : tuple of Measured
        White, black and greys.
    waves : tuple of Wave
    pairs : tuple of Pair
    shifted : tuple of Measured
        Patterns of two levels without inverses, where there are neither waves nor pairs.
    left_out : dict
        For each reason the numbers of the patterns.
    unchanging : float
        Share of the projector's pixels that the shifted patterns all light, or all leave dark.
    """

    uniform: tuple[Measured, ...]
    waves: tuple[Wave, ...]
    pairs: tuple[Pair, ...]
    shifted: tuple[Measured, ...]
    left_out: dict[str, tuple[int, ...]]
    unchanging: float = 0.0

    @property
    def structured(self) -> tuple[Measured, ...]:
        """The patterns that separate, without the uniform ones."""
        waves = [pattern for wave in self.waves for pattern in wave.patterns]
        return (*waves, *(pattern for pair in self.pairs for pattern in pair), *self.shifted)

    @property
    def photos(self) -> tuple[int, ...]:
        """Numbers of all photos that are used, in their order."""
        return tuple(sorted(each.number for each in (*self.uniform, *self.structured)))

    @property
    def axes(self) -> tuple[bool, bool]:
        """Whether patterns vary from row to row, and from column to column."""
        along = [pattern.axes for pattern in self.structured]
        return any(down for down, _ in along), any(across for _, across in along)


def choose_patterns(
    recognised: Recognised,
    read: Callable[[int], Floats],
    *,
    period: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Choice:
    """Choose the patterns that separate direct from global light.

    Parameters
    ----------
    recognised : Recognised
    read : callable
        Reads a pattern as light, (Py, Px) or (Py, Px, 3), by its number.
    period : float, optional
        Period in pixels of the patterns to use; by default the finest.
    progress : callable, optional
        Called with the share of the patterns that is measured.

    Returns
    -------
    Choice

    Raises
    ------
    InputError
        If no patterns serve; the message says why each does not.
    """
    uniform, candidates = [], []
    left_out: dict[str, list[int]] = {}
    for number, content in enumerate(recognised.contents):
        level = read(number)
        measured = measure(number, content, level.mean(axis=-1) if level.ndim == 3 else level)
        reason = _reason(measured, level)
        if isinstance(content, Uniform):
            uniform.append(measured)
        elif reason is None:
            candidates.append(measured)
        else:
            left_out.setdefault(reason, []).append(number)
        if progress is not None:
            progress((number + 1) / len(recognised.contents))
    waves, pairs, single = _group(recognised, candidates, _tell_black(uniform))
    groups: Sequence[Wave | Pair | Measured] = [*waves, *pairs] or single
    kept = _of_period(groups, period)
    chosen = Choice(
        tuple(uniform),
        tuple(each for each in kept if isinstance(each, Wave)),
        tuple(each for each in kept if isinstance(each, Pair)),
        tuple(each for each in kept if isinstance(each, Measured)),
        {},
    )
    used, grouped = set(chosen.photos), {p.number for each in groups for p in _patterns(each)}
    for measured in candidates:
        if measured.number not in used:
            reason = TOO_FEW_PHASES if isinstance(measured.content, Fringes) else NO_INVERSE
            if measured.number in grouped:
                reason = COARSER if measured.period > SHORTEST_PERIOD else TOO_FINE
                reason = reason if period is None else OTHER_PERIOD
            left_out.setdefault(reason, []).append(measured.number)
    if not kept or 0 < len(chosen.shifted) < FEWEST_SHIFTED:
        raise InputError(_refusal(left_out, len(chosen.shifted), period))
    found = {reason: tuple(numbers) for reason, numbers in left_out.items()}
    return replace(chosen, left_out=found, unchanging=_unchanging(chosen.shifted, read))


def measure(number: int, content: Content, level: Floats) -> Measured:
    """Measure the levels, the period and the axes of a grey pattern, (Py, Px)."""
    lowest, highest = float(level.min()), float(level.max())
    bright = level > 0.5 * (lowest + highest)
    changes = (np.diff(bright, axis=axis) for axis in (0, 1))
    cycles = max((0.5 * float(each.mean()) for each in changes if each.size), default=0.0)
    axes = (bool(np.ptp(level, axis=0).max() > 0), bool(np.ptp(level, axis=1).max() > 0))
    period = 1 / cycles if cycles else inf
    mean = float(level.mean(dtype=np.float64))
    if isinstance(content, Fringes):
        period = 1 / max(content.fy, abs(content.fx))
        # Cycles that are cut off at the border say nothing of the light within.
        mean = content.mean
        lowest, highest = mean - content.amplitude, mean + content.amplitude
    return Measured(number, content, mean, lowest, highest, period, axes)


def _unchanging(shifted: Sequence[Measured], read: Callable[[int], Floats]) -> float:
    """Return the share of the pixels that all patterns light, or all leave dark."""
    if not shifted:
        return 0.0
    bright = sum(read(each.number) > 0.5 * (each.lowest + each.highest) for each in shifted)
    return float(np.mean((bright == 0) | (bright == len(shifted))))


def _reason(measured: Measured, level: Floats) -> str | None:
    """Return why a pattern does not serve by itself, None if it does."""
    content = measured.content
    if isinstance(content, AnyPicture):
        return NO_KIND
    contrast = measured.highest - measured.lowest
    if contrast < LEAST_CONTRAST:
        return TOO_FAINT
    if not isinstance(content, Fringes):
        share = (measured.mean - measured.lowest) / contrast
        if not LEAST_LEVEL_SHARE <= share <= 1 - LEAST_LEVEL_SHARE:
            return TOO_LITTLE_WHITE
    return TOO_SLOW if _slow_share(content, level) > LARGEST_SLOW_SHARE else None


def _slow_share(content: Content, level: Floats) -> float:
    """Return the share of a pattern's deviation that its mean over an even neighbourhood keeps."""
    size = [max(FEWEST_EVEN_PIXELS, round(EVEN_SHARE * side)) for side in level.shape]
    if isinstance(content, Fringes):
        # That of the whole wave, so that all its phases are taken, or none.
        return float(abs(np.sinc(size[0] * content.fy) * np.sinc(size[1] * content.fx)))
    return float(uniform_filter(level, size, mode="reflect").std() / level.std())


def _tell_black(uniform: Iterable[Measured]) -> bool:
    """Return whether uniform patterns tell white and black."""
    levels = [each.mean for each in uniform]
    return bool(levels) and max(levels) - min(levels) >= LEAST_CONTRAST


def _group(
    recognised: Recognised, candidates: Sequence[Measured], has_uniform: bool
) -> tuple[list[Wave], list[Pair], list[Measured]]:
    """Return fringes by frequency, pairs of inverses, and patterns of two levels by themselves."""
    fringes = [each for each in candidates if isinstance(each.content, Fringes)]
    # With white and black, cosine and sine suffice.
    fewest = FEWEST_PHASES - has_uniform
    waves = [wave for wave in _waves(recognised, fringes) if _distinct(wave.phases) >= fewest]
    binary = {e.number: e for e in candidates if not isinstance(e.content, Fringes)}
    pairs = []
    for number, inverse in enumerate(recognised.inverse_of):
        if number in binary and inverse in binary:
            pairs.append(Pair(binary[inverse], binary[number]))
    paired = {pattern.number for pair in pairs for pattern in pair}
    return waves, pairs, [each for number, each in binary.items() if number not in paired]


def _waves(recognised: Recognised, fringes: Sequence[Measured]) -> list[Wave]:
    height, width = recognised.size
    found: list[list[tuple[Measured, Fringes]]] = []
    for each in fringes:
        content = each.content
        assert isinstance(content, Fringes)
        for wave in found:
            first = wave[0][1]
            off = abs(content.fy - first.fy) * height + abs(content.fx - first.fx) * width
            if off < SAME_CYCLES:
                wave.append((each, content))
                break
        else:
            found.append([(each, content)])
    middle = (0.5 * (height - 1), 0.5 * (width - 1))
    return [
        Wave(
            tuple(each for each, _ in wave),
            tuple(c.phase + c.fy * middle[0] + c.fx * middle[1] for _, c in wave),
        )
        for wave in found
    ]


def _distinct(phases: Sequence[float]) -> int:
    """Count phases; one that is opposite to the only other tells nothing more."""
    kept: list[float] = []
    for phase in phases:
        if all(abs((phase - other + 0.5) % 1.0 - 0.5) > SAME_PHASE for other in kept):
            kept.append(phase)
    if len(kept) == 2 and abs(abs(kept[0] - kept[1]) % 1.0 - 0.5) < SAME_PHASE:
        return 1
    return len(kept)


def _patterns(group: Wave | Pair | Measured) -> tuple[Measured, ...]:
    match group:
        case Wave():
            return group.patterns
        case Pair():
            return group.pattern, group.inverse
    return (group,)


def _of_period(
    groups: Sequence[Wave | Pair | Measured], period: float | None
) -> list[Wave | Pair | Measured]:
    """Return the groups of the finest patterns, or of those of about a period."""
    periods = [_patterns(group)[0].period for group in groups]
    if not periods:
        return []
    if period is not None:
        low, high = period / PERIOD_RANGE**0.5, period * PERIOD_RANGE**0.5
    else:
        low = min((each for each in periods if each >= SHORTEST_PERIOD), default=min(periods))
        high = PERIOD_RANGE * low
    # Periods of patterns that are equally fine differ by what is cut off at the border.
    return [
        group
        for group, each in zip(groups, periods, strict=True)
        if low * 0.99 <= each <= high * 1.01
    ]


def _refusal(left_out: dict[str, list[int]], shifted: int, period: float | None) -> str:
    reasons = [f"{len(numbers)} {reason}" for reason, numbers in left_out.items()]
    if shifted:
        reasons.append(f"{shifted} of two levels without inverses are too few")
    why = "; ".join(reasons) or "all are uniform"
    of = "" if period is None else f" of a period of about {period:g} pixels"
    return (
        f"no patterns{of} separate direct from global light: {why}; give fringes of a short period "
        f"in three phases or more, or fine checkerboards, stripes or random pixels with inverses; "
        f"a complete set can be made a T.npy first, by `reconstruct()`, and separated by `rig`."
    )
