"""Coordinate descent for least squares without negative entries.

Index convention: o and p run over entries, c over camera pixels.
"""

import numpy as np

from nearfar.arrays import Floats
from nearfar.compiled import compiled

# Sweeps over the entries.
SWEEPS = 15


@compiled
def descend(left: Floats, entries: Floats, gram: Floats, inverse: Floats, ridge: Floats) -> None:
    """Descend along one entry after the other; see `nonnegative_entries`.

    Parameters
    ----------
    left : ndarray, shape (O, C)
        Scores less those of the entries; overwritten.
    entries : ndarray, shape (O, C)
        0 to begin with; overwritten.
    gram : ndarray, shape (O, O, C)
    inverse : ndarray, shape (O, C)
        Of the diagonal, 0 where an entry stays 0.
    ridge : ndarray, shape (O,)
    """
    step = np.empty_like(left[0])
    for _ in range(SWEEPS):
        for o in range(len(left)):
            for c in range(len(step)):
                before = entries[o, c]
                change = left[o, c] * inverse[o, c] - ridge[o] * before
                entries[o, c] = max(before + change / (1 + ridge[o]), 0.0)
                step[c] = entries[o, c] - before
            for p in range(len(left)):
                its_left, of_both = left[p], gram[o, p]
                for c in range(len(step)):
                    its_left[c] -= step[c] * of_both[c]
