"""What the neighbours of a camera pixel expect of it.

Near- and far-range light changes slowly over a surface. The mean over the neighbours, as a share
of white, is what a camera pixel is expected to show; it is trusted as far as the neighbours
differ by no more than their noise (the local linear minimum mean square error filter; Lee, IEEE
PAMI 2, 1980), so that edges stay.

Index convention: arrays are (Cy, Cx, channels, j), j over coefficients.
"""

import numpy as np
from scipy.ndimage import uniform_filter

from nearfar.arrays import Booleans, Floats

# Side of the neighbourhood, camera pixels.
SIDE = 3
# Light is never known better than to this share of white.
EXACT = 1e-6
TINY = 1e-30


def _mean(values: Floats) -> Floats:
    """Mean over the neighbourhood."""
    size = (SIDE, SIDE) + (1,) * (values.ndim - 2)
    return np.asarray(uniform_filter(values, size, mode="nearest"))


def expect_each(values: Floats, variance: Floats, known: Booleans) -> Floats:
    """Expect each coefficient by itself.

    Parameters
    ----------
    values : ndarray, shape (Cy, Cx, channels, J)
        As shares of white.
    variance : ndarray, shape (Cy, Cx, channels, J)
        Of their noise, above 0.
    known : ndarray of bool, shape (Cy, Cx)
        Camera pixels that have a say.
    """
    weight = known[..., None, None] / variance
    total = np.maximum(_mean(weight), TINY)
    mean = _mean(weight * values) / total
    scatter = _mean(weight * values**2) / total - mean**2
    change = np.maximum(scatter - 1.0 / total, 0.0)
    return np.asarray(mean + change / (change + variance) * (values - mean))


def expect_together(values: Floats, variance: Floats, known: Booleans) -> Floats:
    """Expect coefficients that belong together: one trust for all of them.

    Parameters
    ----------
    values : ndarray, shape (Cy, Cx, channels, J)
        As shares of white.
    variance : ndarray, shape (Cy, Cx, channels)
        Mean over j of that of their noise.
    known : ndarray of bool, shape (Cy, Cx)
        Camera pixels that have a say; the rest expect nothing.
    """
    weight = (known[..., None, None] / np.maximum(variance, EXACT**2)[..., None]).astype(
        values.dtype
    )
    # A running mean leaves traces of what it has passed: without a neighbour there is nothing.
    alone = uniform_filter(known.astype(np.float32), SIDE, mode="nearest") < 0.5 / SIDE**2
    weight[alone] = 1.0
    total = np.maximum(_mean(weight), TINY)
    mean = np.where(alone[..., None, None], 0.0, _mean(weight * values) / total)
    scatter = np.mean(_mean(weight * values**2) / total - mean**2, axis=-1, keepdims=True)
    change = np.maximum(scatter - 1.0 / total, 0.0)
    trust = change / np.maximum(change + variance[..., None], TINY)
    return np.asarray((mean + trust * (values - mean)) * known[..., None, None])
