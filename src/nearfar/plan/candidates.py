"""Frequencies that a plan is chosen from, one of each +-k, without DC."""

import math
from fractions import Fraction

import numpy as np

from nearfar.arrays import Size
from nearfar.illumination.frequencies import (
    CHECKERBOARD,
    DC,
    Frequency,
    as_array,
    far_frequencies,
    grid,
    representatives,
    wrap,
)
from nearfar.plan.expect import LOWEST_CYCLES

# Beyond LOWEST_CYCLES, one frequency in each of these shares of 1/W is a candidate: a window's
# spectrum changes no faster.
STEP_SHARE = 0.5
# Highest frequency at a pitch over 1, in cycles per projector pixel. The blur of projectors and
# cameras hides those towards the checkerboard.
HIGHEST = 0.4
# Share of the photos that are of frequencies above those of the grid of cells, at a pitch over 1.
# There a row's response is direct light alone, whose phase tells q to a fraction of a pixel, and
# whose fall its footprint. 15 pairs of 200 photos found q to a tenth of a pixel.
HIGH_SHARE = 0.15
# Pairs of such photos: no more than settle the footprint, and ten at least, as long as these are
# a quarter of the photos, less the first 16, which the lowest frequencies need, or fewer. With six
# of 90 photos, the corner before a coarse camera lost 8 dB.
ENOUGH_HIGH, MOST_HIGH = 10, 40
LARGEST_HIGH_SHARE, FIRST_PHOTOS = 0.25, 16
# And at least one in each direction.
FEWEST_HIGH = 4
# Their directions, (y, x), in turn from the highest on.
_DIAGONAL = math.sqrt(0.5)
DIRECTIONS = ((1.0, 0.0), (0.0, 1.0), (_DIAGONAL, _DIAGONAL), (_DIAGONAL, -_DIAGONAL))


def finest_pattern(projector: Size) -> Frequency:
    """Return the highest frequency: the checkerboard, or alternate pixels of one row or column."""
    return wrap(
        *(k if side > 1 else DC.fy for k, side in zip(CHECKERBOARD, projector, strict=True))
    )


def candidates(projector: Size, window: int, pitch: int = 1) -> list[Frequency]:
    """Frequencies of the projector's DFT to choose from, one of each +-k, without DC.

    Parameters
    ----------
    projector : Size
    window, pitch : int
        W, and the projector pixels between the window's functions. Frequencies reach to half a
        cycle per pitch on each axis.
    """
    low = Size(*(min(2 * LOWEST_CYCLES + 1, side) for side in projector))
    steps = round(window / STEP_SHARE)
    rounded = [
        wrap(*(_on_grid(part / pitch, side) for part, side in zip(k, projector, strict=True)))
        for k in grid(Size(steps, steps), Size(steps, steps))
    ]
    listed = far_frequencies(low, projector) + rounded
    if pitch == 1:
        finest = finest_pattern(projector)
        halves = [finest, wrap(finest.fy, DC.fx), wrap(DC.fy, finest.fx)]
        even = all(side % 2 == 0 for side in projector)
        listed += halves if even else [finest]
    return [k for k in representatives(listed) if k != DC]


def high_frequencies(projector: Size, pitch: int, photos: int) -> list[Frequency]:
    """Return the frequencies above those of the grid of cells, the highest first.

    They fall evenly by ratio from `HIGHEST` towards half a cycle per pitch, so that each step in
    the phase of direct light leaves the next without ambiguity.

    Parameters
    ----------
    projector : Size
    pitch : int
        Over 1.
    photos : int
        Photos of transport and references together.

    Returns
    -------
    list of Frequency
        On the projector's DFT, one of each +-k.
    """
    enough = min(ENOUGH_HIGH, round(LARGEST_HIGH_SHARE * (photos - FIRST_PHOTOS) / 2))
    count = min(MOST_HIGH, max(FEWEST_HIGH, enough, round(HIGH_SHARE * photos / 2)))
    ratio = HIGHEST * 2 * pitch
    found = []
    for number in range(count):
        cycles = HIGHEST * ratio ** (-number / count)
        direction = DIRECTIONS[number % len(DIRECTIONS)]
        if min(projector) == 1:
            # All frequencies lie along the only row or column.
            direction = (float(projector.height > 1), float(projector.width > 1))
        parts = (Fraction(cycles * part) for part in direction)
        found.append(
            wrap(*(_on_grid(part, side) for part, side in zip(parts, projector, strict=True)))
        )
    return representatives(found)


def lowest_first(projector: Size) -> list[Frequency]:
    """All frequencies of the projector's DFT, one of each +-k, without DC, the lowest first."""
    listed = [k for k in representatives(grid(projector, projector)) if k != DC]
    cycles = np.linalg.norm(as_array(listed) * np.array(projector), axis=1)
    return [listed[i] for i in np.argsort(cycles, kind="stable")]


def _on_grid(part: Fraction, side: int) -> Fraction:
    return Fraction(round(part * side), side)
