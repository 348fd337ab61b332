"""Blurring by hats, each from the hat that is half as wide.

A hat of pitch 2 p is the hat of pitch p, moved by -p, 0 and p pixels with the weights 1/4, 1/2 and
1/4. Along both axes that takes one pass over the pixels, whatever the pitch.

Index convention: y, x are rows and columns of one level of a pyramid.
"""

import numpy as np

from nearfar.arrays import Floats, blocks
from nearfar.compiled import compiled
from nearfar.parallel import side_by_side

# Rows of a thread: each block sums the rows `pitch` above and below it as well.
ROWS_AT_ONCE = 256


def widen(blurred: Floats, pitch: int, part: tuple[slice, slice], wider: Floats) -> None:
    """Write what a hat twice as wide makes of a light that is blurred by a hat.

    Parameters
    ----------
    blurred : ndarray, shape (rows, columns)
        By the hat of `pitch`; what lies beyond its border is taken to be 0.
    pitch : int
    part : tuple of slice
        Rows and columns that are written.
    wider : ndarray, shape (rows, columns)
        By the hat of twice the pitch.
    """
    rows, columns = (
        range(*side.indices(length)) for side, length in zip(part, blurred.shape, strict=True)
    )

    def work(batch: slice) -> None:
        some = rows[batch]
        _widen(blurred, pitch, some.start, some.stop, columns.start, columns.stop, wider)

    side_by_side(work, blocks(len(rows), ROWS_AT_ONCE))


@compiled
def _widen(
    blurred: Floats, pitch: int, top: int, bottom: int, left: int, right: int, wider: Floats
) -> None:
    height, width = blurred.shape
    scale = blurred.dtype.type(1 / 16)
    # Of three rows, from `pitch` columns before the first to as many after the last; 0 beyond the
    # border. Slices begin at 0, which lets the compiler use vector instructions.
    sums = np.zeros(right - left + 2 * pitch, dtype=blurred.dtype)
    first, last = max(0, left - pitch), min(width, right + pitch)
    known = sums[first + pitch - left : last + pitch - left]
    before, middle, after = sums[: right - left], sums[pitch:], sums[2 * pitch :]
    for y in range(top, bottom):
        own, out = blurred[y, first:last], wider[y, left:right]
        for x in range(len(known)):
            known[x] = own[x] + own[x]
        if y >= pitch:
            above = blurred[y - pitch, first:last]
            for x in range(len(known)):
                known[x] += above[x]
        if y + pitch < height:
            below = blurred[y + pitch, first:last]
            for x in range(len(known)):
                known[x] += below[x]
        for x in range(len(out)):
            out[x] = (before[x] + middle[x] + middle[x] + after[x]) * scale
