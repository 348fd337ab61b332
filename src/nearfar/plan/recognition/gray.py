"""Gray code among pictures of one axis: which bit of row or column numbers each shows.

Index convention: arrays are (pictures, places).
"""

from collections.abc import Sequence

import numpy as np

from nearfar.arrays import Booleans
from nearfar.plan.recognition.contents import Axis, GrayBit

# Share of the bits of a code that pictures must show before they count as this code.
LEAST_SHARE_OF_BITS = 0.6
FEWEST_BITS = 2


def find_gray_code(axis: Axis, codes: Sequence[Booleans]) -> list[GrayBit | None]:
    """Recognise the bits of one Gray code among binary codes of one axis.

    The numbers start at 0 at the first row or column and each is shared by a cell of one or more of
    them; or they are centred, so that as many are left out at the start as at the end.

    Parameters
    ----------
    axis : {"rows", "columns"}
    codes : sequence of ndarray of bool, shape (places,)

    Returns
    -------
    list of GrayBit or None
        For each code the bit that it shows, None if it shows none; all None if fewer than
        `LEAST_SHARE_OF_BITS` of the bits of a Gray code are there.
    """
    nothing: list[GrayBit | None] = [None] * len(codes)
    if len(codes) < FEWEST_BITS:
        return nothing
    every = np.array(codes)
    places = every.shape[1]
    changes = (every[:, 1:] != every[:, :-1]).any(axis=0)
    if not changes.any():
        return nothing
    # The finest bit changes first, after one cell.
    cell = int(np.argmax(changes)) + 1
    centred = ((1 << (places - 1).bit_length()) - places) // 2
    found = [_matched(axis, every, cell, 0)]
    if centred:
        found.append(_matched(axis, every, 1, centred))
    best = max(found, key=lambda bits: sum(bit is not None for bit in bits))
    shown = {bit.bit for bit in best if bit is not None}
    first, size = (centred, 1) if len(found) > 1 and best is found[1] else (0, cell)
    last = (places - 1) // size + first
    if len(shown) < max(FEWEST_BITS, LEAST_SHARE_OF_BITS * last.bit_length()):
        return nothing
    return best


def _matched(axis: Axis, every: Booleans, cell: int, first: int) -> list[GrayBit | None]:
    """Return the bit of one Gray code that each picture shows."""
    number = np.arange(every.shape[1]) // cell + first
    gray = number ^ (number >> 1)
    found: list[GrayBit | None] = [None] * len(every)
    for bit in range(int(number[-1]).bit_length()):
        white = (gray >> bit & 1).astype(bool)
        for inverse in (False, True):
            for picture in np.flatnonzero((every == (white ^ inverse)).all(axis=1)):
                found[picture] = GrayBit(
                    axis=axis, bit=bit, cell=cell, first=first, inverse=inverse
                )
    return found
