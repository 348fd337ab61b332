"""The error bar of q: a standard deviation on each axis, right up to one factor for all of it.

No method of correspondence tells the error of q, and most of it is no noise:

- A camera pixel sees a few whole projector pixels. The centroid of their light is where the middle
  of the camera pixel looks if its footprint is as wide as a whole number of projector pixels.
  Else it errs by up to half of one: of a footprint of width w, with f the fraction of w, the
  variance is f^2 (1 - f)^2 / (12 w^2) over all places of the footprint. At w = 1/2 that is 1/48.
- At edges a camera pixel sees two surfaces, and their light is noisy. Both show as scatter: the
  variance of q(c - 1) - 2 q(c) + q(c + 1) is 6 times that of q, where the surface is flat so far.

What neighbours err by alike shows in neither, so that the deviation is right up to a factor. What q
misses the epipolar lines by tells it (`nearfar.applications.depth`).
"""

import numpy as np

from nearfar.arrays import Booleans, Floats

# Camera pixels on each side whose scatter is pooled, and by whose q the footprint is measured.
POOLED = 1
FOOTPRINT_REACH = 2
# Where q of all neighbours agrees, it is no more certain than this, in projector pixels.
LEAST_DEVIATION = 0.03
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
    variance = _usual_where_unknown(_scatter(values), lit)
    variance += _usual_where_unknown(_of_footprint(_width(values)), lit)
    return np.where(lit, np.sqrt(variance + LEAST_DEVIATION**2), np.nan)


def _usual_where_unknown(variance: Floats, lit: Booleans) -> Floats:
    known = lit & np.isfinite(variance)
    usual = float(np.median(variance[known])) if known.any() else 0.0
    return np.where(np.isfinite(variance), variance, usual)


def _scatter(q: Floats) -> Floats:
    """Return the variance of q by its second differences, NaN where there are none."""
    total, count = np.zeros(q.shape), np.zeros(q.shape)
    for axis in (0, 1):
        bent = _beside(q, axis, 1) - 2 * q + _beside(q, axis, -1)
        known = np.isfinite(bent)
        total += _pooled(np.where(known, bent, 0.0) ** 2)
        count += _pooled(known.astype(np.float64))
    known = count > 0
    mean = np.where(known, total / np.where(known, count, 1.0), np.nan)
    return mean / VARIANCE_OF_SECOND_DIFFERENCE


def _width(q: Floats) -> Floats:
    """Return the width of each camera pixel's footprint on each axis of the projector."""
    square = np.zeros(q.shape)
    for axis in (0, 1):
        steps = [step for step in range(-FOOTPRINT_REACH, FOOTPRINT_REACH + 1) if step]
        slopes = np.stack([np.abs(_beside(q, axis, step) - q) / abs(step) for step in steps])
        # The lower median of those that are known: an edge is in few of them. NaN sort last.
        slopes.sort(axis=0)
        middle = np.maximum(np.isfinite(slopes).sum(axis=0) - 1, 0) // 2
        square += np.take_along_axis(slopes, middle[None], axis=0)[0] ** 2
    return np.asarray(np.sqrt(square))


def _of_footprint(width: Floats) -> Floats:
    """Return the variance of a centroid of whole pixels about the middle of a box, by its width."""
    fraction = width % 1.0
    part = np.where(width > 0, fraction / np.where(width > 0, width, 1.0), 1.0)
    return np.asarray((part * (1 - fraction)) ** 2 / 12)


def _beside(q: Floats, axis: int, step: int) -> Floats:
    """Return q of the camera pixel so many steps on, NaN beyond the border."""
    found = np.full(q.shape, np.nan)
    there, here = np.moveaxis(q, axis, 0), np.moveaxis(found, axis, 0)
    count = max(0, len(there) - abs(step))
    here[max(0, -step) :][:count] = there[max(0, step) :][:count]
    return found


def _pooled(values: Floats) -> Floats:
    """Return sums over each camera pixel and those beside it, on both axes."""
    summed = values
    for axis in (0, 1):
        around = [np.nan_to_num(_beside(summed, axis, step)) for step in range(-POOLED, POOLED + 1)]
        summed = np.sum(around, axis=0)
    return np.asarray(summed)
