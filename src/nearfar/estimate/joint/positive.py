"""Transport is never negative: window entries are moved no further than that asks.

Where n and f together would be below 0 at a window entry, n is raised to what f lacks, and all
other entries give as much as the window gained (the Euclidean projection on a simplex; Michelot,
JOTA 50, 1986), so that white stays what it was. Entries next to q share their light with d and are
left alone.

Index convention: arrays are (n, channels, W^2).
"""

import numpy as np

from nearfar.arrays import Booleans, Floats

# The active set shrinks at every turn; this many are never needed for windows that were measured.
TURNS = 60


def raise_to(values: Floats, least: Floats, free: Booleans) -> Floats:
    """Return the nearest values that are nowhere below `least` and have the same sum.

    Parameters
    ----------
    values, least : ndarray, shape (..., E)
    free : ndarray of bool, shape (..., E)
        Entries that may change, and that the sum is of.

    Returns
    -------
    ndarray, shape (..., E), float32
        Unchanged where the sum is too small for it.
    """
    above = np.where(free, values - least, 0.0).astype(np.float64)
    total = above.sum(axis=-1, keepdims=True)
    active = free & (above > 0)
    taken = np.zeros_like(total)
    for _ in range(TURNS):
        count = np.maximum(active.sum(axis=-1, keepdims=True), 1)
        taken = (np.sum(above * active, axis=-1, keepdims=True) - total) / count
        smaller = active & (above > taken)
        if np.array_equal(smaller, active):
            break
        active = smaller
    raised = least + np.maximum(above - taken, 0.0)
    return np.where(free & (total > 0), raised, values).astype(np.float32)
