"""Patterns for direct-global separation: shifted checkerboards and shifted sinusoids.

Patterns are (n, Py, Px), uint8, 255 = full white, in the order to shoot. Each projector pixel is
lit and unlit, and white half the time, as the method asks (Nayar, Krishnan, Grossberg and Raskar,
"Fast Separation of Direct and Global Components of a Scene using High Frequency Illumination",
SIGGRAPH 2006, sections 4.1 and 4.3).
"""

from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.illumination.frequencies import wrap
from nearfar.illumination.patterns import invert, phase, quantise

# Measured on the built-in scenes (benchmarks/separation.py): the smallest squares that also find
# the direct light of camera pixels which straddle projector pixels, and the shortest sinusoid.
DEFAULT_SIDE = 2
DEFAULT_PERIOD = 3
DEFAULT_SHIFTS = 4


def default_step(side: int) -> int:
    """Half a square, rounded up: finer steps cost many photos and gain 2 dB at the most."""
    return (side + 1) // 2


def checkerboards(
    projector: Size, side: int = DEFAULT_SIDE, step: int | None = None
) -> NDArray[np.uint8]:
    """Draw a checkerboard shifted over both axes, each shift followed by its inverse.

    A shift by a whole square is the inverse, so that shifts within one square and their inverses
    are all there are.

    Parameters
    ----------
    projector : Size
        Pattern grid, at least two squares on both axes, or on one if it has a single row or column.
    side : int
        Side of a square, projector pixels.
    step : int, optional
        Projector pixels from one shift to the next, 1 to `side`; by default `default_step`.

    Returns
    -------
    ndarray, shape (2 * ceil(side / step)**2, Py, Px), uint8
        0 and 255; pattern 2 j + 1 is 255 less pattern 2 j.

    Raises
    ------
    InputError
        If the squares do not fit the projector or the step does not fit the squares.
    """
    step = default_step(side) if step is None else step
    shorter = shorter_axis(projector)
    if side < 1 or 2 * side > shorter:
        raise InputError(
            f"`side={side}` does not fit a projector of {projector}, which holds squares of 1 to "
            f"{shorter // 2} pixels: choose one of these."
        )
    offsets = _offsets(side, step)
    drawn = []
    for down in offsets:
        for across in offsets:
            y = (np.arange(projector.height) + down) // side
            x = (np.arange(projector.width) + across) // side
            white = (y[:, None] + x[None, :]) % 2 == 0
            board = (np.uint8(255) * white).astype(np.uint8)
            drawn += [board, invert(board)]
    return np.stack(drawn)


def shorter_axis(projector: Size) -> int:
    """Return the shorter side that patterns can vary along, which one of a single pixel is not.

    Raises
    ------
    InputError
        If there is none.
    """
    sides = [side for side in projector if side > 1]
    if not sides:
        raise InputError(
            f"a projector of {projector} shows no pattern to separate by: give a larger one."
        )
    return min(sides)


def count_checkerboards(side: int = DEFAULT_SIDE, step: int | None = None) -> int:
    """Count the patterns of `checkerboards`."""
    return 2 * len(_offsets(side, default_step(side) if step is None else step)) ** 2


def _offsets(side: int, step: int) -> range:
    if side < 1 or not 1 <= step <= side:
        raise InputError(
            f"`step={step}` does not suit squares of {side} pixels: choose squares of 1 pixel or "
            f"more and a step of 1 pixel to a whole square."
        )
    return range(0, side, step)


def sinusoids(
    projector: Size, period: int = DEFAULT_PERIOD, shifts: int = DEFAULT_SHIFTS
) -> NDArray[np.uint8]:
    """Draw 0.5 + 0.5 cos(2 pi (y / period + j / shifts)), j = 0 ... shifts - 1, then along x.

    Parameters
    ----------
    projector : Size
        Pattern grid, at least a period on both axes. Along an axis of a single pixel nothing
        varies: the patterns of the other are drawn twice.
    period : int
        Projector pixels, at least 2.
    shifts : int
        Phases, at least 3, equally spaced over a cycle.

    Returns
    -------
    ndarray, shape (2 * shifts, Py, Px), uint8
        With an even number of shifts, pattern j + shifts / 2 is 255 less pattern j.

    Raises
    ------
    InputError
        If there are too few shifts or the period does not fit the projector.
    """
    shorter = shorter_axis(projector)
    if not 2 <= period <= shorter:
        raise InputError(
            f"`period={period}` does not fit a projector of {projector}: choose a period of 2 to "
            f"{shorter} pixels."
        )
    count = count_sinusoids(shifts) // 2
    drawn: list[NDArray[np.uint8]] = []
    down, across = (Fraction(1, period), Fraction(0)), (Fraction(0), Fraction(1, period))
    if projector.height == 1:
        down = across
    elif projector.width == 1:
        across = down
    for cycles in (down, across):
        start = phase(wrap(*cycles), projector)
        shifted = [
            quantise(0.5 + 0.5 * np.cos(2 * np.pi * (start + j / count))) for j in range(count)
        ]
        if count % 2 == 0:
            # Rounded on their own, two opposite phases could sum to a little more than white.
            half = shifted[: count // 2]
            shifted = half + [invert(pattern) for pattern in half]
        drawn += shifted
    return np.stack(drawn)


def count_sinusoids(shifts: int = DEFAULT_SHIFTS) -> int:
    """Count the patterns of `sinusoids`.

    Raises
    ------
    InputError
        If there are fewer than 3 shifts.
    """
    if shifts < 3:
        raise InputError(
            f"`shifts={shifts}` cannot tell offset and amplitude apart: choose 3 or more."
        )
    return 2 * shifts
