"""Non-negative transport, by the smallest change of window entries.

Where n + f is negative at a window entry, n is raised until n + f is 0. The other entries are
lowered by as much in total, so that the response to white does not change: the Euclidean projection
onto a simplex (Michelot, JOTA 50, 1986). Entries next to q share their light with d and do not
change.

Index convention: arrays are (n, channels, W^2).
"""

from nearfar.arrays import Booleans, Floats, namespace

# The active set shrinks at every iteration; measured windows have settled well before this many.
MAXIMUM_ITERATIONS = 60


def raise_to(values: Floats, least: Floats, free: Booleans) -> Floats:
    """Return the nearest values that are at least `least` and have the same sum.

    Parameters
    ----------
    values, least : ndarray, shape (..., E)
    free : ndarray of bool, shape (..., E)
        Entries that may change; the sum is over them.

    Returns
    -------
    ndarray, shape (..., E), float32
        The values themselves where their sum is too small.
    """
    xp = namespace(values)
    above = xp.astype(xp.where(free, values - least, 0.0), xp.float64)
    total = xp.sum(above, axis=-1, keepdims=True)
    active = free & (above > 0)
    taken = xp.zeros_like(total)
    for _ in range(MAXIMUM_ITERATIONS):
        count = xp.clip(xp.sum(xp.astype(active, xp.float64), axis=-1, keepdims=True), min=1.0)
        taken = (xp.sum(above * active, axis=-1, keepdims=True) - total) / count
        smaller = active & (above > taken)
        if bool(xp.all(smaller == active)):
            break
        active = smaller
    raised = least + xp.clip(above - taken, min=0.0)
    moved = xp.where(free & (total > 0), raised, xp.astype(values, raised.dtype))
    found: Floats = xp.astype(moved, xp.float32)
    return found
