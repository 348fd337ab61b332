"""Least squares without negative entries, for many camera pixels at once."""

import numpy as np

from nearfar.arrays import Booleans, Floats

# Sweeps over the entries.
SWEEPS = 15


def nonnegative_entries(
    scores: Floats, gram: Floats, inside: Booleans, ridge: Floats
) -> tuple[Floats, Floats]:
    """Least squares with no negative entry, by coordinate descent over all pixels at once.

    Parameters
    ----------
    scores : ndarray, shape (O, C)
    gram : ndarray, shape (O, O, C)
    inside : ndarray, shape (O, C)
        Entries to fit; the others are 0.
    ridge : ndarray, shape (O,)

    Returns
    -------
    entries : ndarray, shape (O, C)
        The solution w.
    explained : ndarray, shape (C,)
        2 s.w - w.G.w, what the entries explain of the weighted sum of squares.
    """
    entries = np.zeros_like(scores)
    left = scores.copy()
    inverse = inside / (gram[0, 0] + 1e-20)
    for _ in range(SWEEPS):
        for o in range(len(scores)):
            change = left[o] * inverse[o] - ridge[o] * entries[o]
            value = np.maximum(entries[o] + change / (1 + ridge[o]), 0.0)
            left -= (value - entries[o]) * gram[o]
            entries[o] = value
    # left = s - G.w, and 2 s.w - w.G.w = (s + left).w
    return entries, np.einsum("oc,oc->c", scores + left, entries)
