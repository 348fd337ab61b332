"""The error bar of q: a standard deviation on each axis, right up to one factor for all of it.

No method of correspondence tells the error of q, and most of it is not noise. A camera pixel sees a
few whole projector pixels, so that the centroid of their light is not where the middle of the
camera pixel looks; and at edges it sees two surfaces. All of these show as scatter: where the
surface is flat, the variance of q(c - 1) - 2 q(c) + q(c + 1) is 6 times that of q.

Errors that neighbours share do not show, so that the deviation is right up to a factor. The factor
follows from the distances of q from the epipolar lines (`nearfar.applications.depth`).
"""

import numpy as np

from nearfar.arrays import Floats

# Camera pixels on each side whose scatter is pooled.
POOLED = 2
# A larger second difference is of an edge between two surfaces, and counts as this: it says that q
# beside the edge may be of both, and not by how much the surfaces are apart.
LARGEST_SECOND_DIFFERENCE = 1.0
# Where q of all neighbours agrees, it is no more certain than this, in projector pixels.
LEAST_DEVIATION = 0.05
# Of q(c - 1) - 2 q(c) + q(c + 1), in variances of q.
VARIANCE_OF_SECOND_DIFFERENCE = 6.0


def deviation_of(q: Floats) -> Floats:
    """Return the standard deviation of q on each axis, up to one factor for all camera pixels.

    Parameters
    ----------
    q : ndarray, shape (Cy, Cx, 2)
        In projector pixels; NaN where there is no direct light.

    Returns
    -------
    ndarray, shape (Cy, Cx, 2), float64
        In projector pixels; NaN where q is. Where no neighbours tell, that of the median camera
        pixel.
    """
    values = np.asarray(q, dtype=np.float64)
    lit = np.isfinite(values)
    total, count = np.zeros(values.shape), np.zeros(values.shape)
    for axis in (0, 1):
        bent = _beside(values, axis, 1) - 2 * values + _beside(values, axis, -1)
        known = np.isfinite(bent)
        bent = np.clip(bent, -LARGEST_SECOND_DIFFERENCE, LARGEST_SECOND_DIFFERENCE)
        total += _pooled(np.where(known, bent, 0.0) ** 2)
        count += _pooled(known.astype(np.float64))
    known = count > 0
    variance = total / np.where(known, count, 1.0) / VARIANCE_OF_SECOND_DIFFERENCE
    usual = float(np.median(variance[known & lit])) if (known & lit).any() else 0.0
    variance = np.where(known, variance, usual) + LEAST_DEVIATION**2
    return np.where(lit, np.sqrt(variance), np.nan)


def _beside(values: Floats, axis: int, step: int) -> Floats:
    """Return the values of the camera pixel so many steps on, NaN beyond the border."""
    found = np.full(values.shape, np.nan)
    there, here = np.moveaxis(values, axis, 0), np.moveaxis(found, axis, 0)
    count = max(0, len(there) - abs(step))
    here[max(0, -step) :][:count] = there[max(0, step) :][:count]
    return found


def _pooled(values: Floats) -> Floats:
    """Return sums over each camera pixel and those about it, on both axes."""
    summed = values
    for axis in (0, 1):
        about = [np.nan_to_num(_beside(summed, axis, step)) for step in range(-POOLED, POOLED + 1)]
        summed = np.sum(about, axis=0)
    return np.asarray(summed)
