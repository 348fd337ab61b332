"""Least squares without negative entries, for many camera pixels at once."""

import numpy as np

from nearfar.arrays import Booleans, Floats, blocks

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
    # Numba takes a while to load, and plans import this module without solving anything.
    from nearfar.correspondence.descent import descend

    entries, left = np.empty_like(scores), np.empty_like(scores)
    inverse = inside / (gram[0, 0] + 1e-20)
    for some in blocks(scores.shape[1], PIXELS_AT_ONCE):
        # Copies without gaps, over which the loop runs several camera pixels at a time.
        its_left, of_both = scores[:, some].copy(), np.ascontiguousarray(gram[..., some])
        found = np.zeros_like(its_left)
        descend(its_left, found, of_both, np.ascontiguousarray(inverse[:, some]), ridge)
        left[:, some], entries[:, some] = its_left, found
    # left = s - G.w, and 2 s.w - w.G.w = (s + left).w
    return entries, np.einsum("oc,oc->c", scores + left, entries)
