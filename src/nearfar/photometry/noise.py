"""The camera's noise as the photos themselves tell it."""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats


class NoiseModel(NamedTuple):
    """Variance of one photo's pixel: gain times its value, plus a floor (photo units)."""

    gain: float
    floor: float

    def variance(self, photo: Floats) -> Floats:
        """Return the variance of a pixel that reads `photo`; at least a hair above 0."""
        least = max(self.floor, 0.0) + 1e-12
        return np.asarray(np.maximum(self.gain * photo + self.floor, least))


def fit_noise(sum_mean: Floats, sum_variance: Floats, dark: float = 0.0) -> NoiseModel:
    """Fit shot and read noise to pair sums.

    A pattern and its inverse sum to the same picture in every pair, so the scatter of the sums
    is the noise of two photos: variance = gain * sum + 2 * floor (shot noise grows with light,
    read noise does not).

    Parameters
    ----------
    sum_mean, sum_variance : ndarray
        Mean and variance of the pair sums at each camera pixel, photo units.
    dark : float
        What a photo under black reads. Part of it may be a black level, which has no noise, so
        the floor may be as low as that much less shot noise, and no lower: a flickering lamp,
        whose variance grows with the square of the light, would ask for less.

    Returns
    -------
    NoiseModel
    """
    # Bins of equal population, medians in each: a few odd pixels (saturated, moving) drop out.
    order = np.argsort(sum_mean.ravel())
    parts = np.array_split(order, min(64, max(2, len(order) // 64)))
    level = np.array([np.median(sum_mean.ravel()[part]) for part in parts])
    variance = np.array([np.median(sum_variance.ravel()[part]) for part in parts])
    if np.ptp(level) <= 1e-9:
        return NoiseModel(0.0, float(np.mean(variance)) / 2)
    weight = 1.0 / np.maximum(variance, 1e-3 * variance.max(initial=0.0) + 1e-30)
    gain, offset = np.polyfit(level, variance, 1, w=weight)
    if gain < 0:
        return NoiseModel(0.0, float(np.median(variance)) / 2)
    return NoiseModel(float(gain), max(float(offset) / 2, -float(gain) * dark))
