"""The window of near-range light: how far apart its functions stand, and how many there are.

The window is described by W x W hat functions that stand `pitch` projector pixels apart; at a pitch
of 1 these are the paper's single pixels. The photos that a scene takes do not grow with the
projector's resolution, so that a plan for a fine projector is that for a grid of cells, each of
pitch x pitch projector pixels.
"""

import math

from nearfar.arrays import Size

# Cells on the shorter side at a pitch over 1: at least half as many, and no more than these.
MOST_CELLS = 53
# Shorter side of the largest projector whose windows are of single pixels. At a pitch of 2 pixels
# these would be nearly as few, so that the least pitch over 1 is 4 (docs/decisions/0051).
LARGEST_OF_SINGLE_PIXELS = 2 * MOST_CELLS
# The same of a single row or column.
LONGEST_LINE_OF_SINGLE_PIXELS = 128
# W where nothing is known: the largest of single pixels, and that at a larger pitch, where
# windows reach over a quarter of the screen (docs/decisions/0042 compares others).
LARGEST_DEFAULT, DEFAULT_AT_PITCH = 25, 9
# f is kept at the measured ones of as many DFT frequencies on each side.
FAR_BAND_SIDE = 13


def pitch_of(projector: Size) -> int:
    """Return the pitch at which windows are planned for a projector.

    Parameters
    ----------
    projector : Size

    Returns
    -------
    int
        Projector pixels between neighbouring functions of the window: 1 up to a shorter side of
        106, beyond that the power of two that leaves 27 to 53 cells on it. Of a single row or
        column, the longer side counts, and it is 1 up to 128.
    """
    pitch, side = 1, _shorter(projector)
    is_line = min(projector) == 1
    if side <= (LONGEST_LINE_OF_SINGLE_PIXELS if is_line else LARGEST_OF_SINGLE_PIXELS):
        return pitch
    while pitch * MOST_CELLS < side:
        pitch *= 2
    return pitch


def side_of_blocks(projector: Size) -> int:
    """Return the side of the smallest blocks that a plan of single cells can be made for.

    Of blocks that leave no more than 106 cells on the shorter side, the smallest that divide both
    sides; or, where that would leave fewer than 53, the smallest.
    """
    shorter = _shorter(projector)
    smallest = -(-shorter // LARGEST_OF_SINGLE_PIXELS)
    common = math.gcd(*(side for side in projector if side > 1))
    dividing = (
        block
        for block in range(smallest, shorter * 2 // LARGEST_OF_SINGLE_PIXELS + 1)
        if common % block == 0
    )
    return next(dividing, smallest)


def largest_window(projector: Size, pitch: int = 1) -> int:
    """Return the largest W: as many functions as stand on the shorter side.

    On a projector of one row or column the longer side counts: a window is the part of its middle
    row or column that lies on the projector.
    """
    return (_shorter(projector) - 1) // pitch + 1


def default_window(projector: Size, pitch: int = 1) -> int:
    """W where nothing is known: a sixth of the shorter side, odd, between 5 and 25.

    On a projector of one row or column it is a sixth of the longer side. At a pitch over 1 it is 9.
    """
    if pitch > 1:
        wanted = DEFAULT_AT_PITCH
    else:
        wanted = min(LARGEST_DEFAULT, max(5, round(_shorter(projector) / 6)))
    return int(min(2 * (wanted // 2) + 1, largest_window(projector, pitch)))


def far_band(projector: Size) -> Size:
    """Return the far band of plans that are chosen: 13 x 13, or as many as the projector has."""
    return Size(*(min(FAR_BAND_SIDE, side - 1 + side % 2) for side in projector))


def _shorter(projector: Size) -> int:
    return min(projector) if min(projector) > 1 else max(projector)
