"""Least squares without negative entries, for many camera pixels at once."""

import numpy as np

from nearfar.arrays import Booleans, Floats, blocks
from nearfar.compiled import compiled

# Sweeps over the entries.
SWEEPS = 15
# Camera pixels at a time: their normal equations stay in the processor's cache.
PIXELS_AT_ONCE = 64


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
    entries, left = np.empty_like(scores), np.empty_like(scores)
    inverse = inside / (gram[0, 0] + 1e-20)
    for some in blocks(scores.shape[1], PIXELS_AT_ONCE):
        # Copies without gaps, over which the loop runs several camera pixels at a time.
        its_left, of_both = scores[:, some].copy(), np.ascontiguousarray(gram[..., some])
        found = np.zeros_like(its_left)
        _descend(its_left, found, of_both, np.ascontiguousarray(inverse[:, some]), ridge)
        left[:, some], entries[:, some] = its_left, found
    # left = s - G.w, and 2 s.w - w.G.w = (s + left).w
    return entries, np.einsum("oc,oc->c", scores + left, entries)


@compiled
def _descend(left: Floats, entries: Floats, gram: Floats, inverse: Floats, ridge: Floats) -> None:
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
