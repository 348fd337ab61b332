"""The camera's noise, estimated from the photos themselves."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats

# Variances above this many times the mean of the lower nine tenths are not noise: something moved.
# Variances of two photos each scatter most; fewer than one in ten thousand of them exceed it.
OUTLIER_FACTOR = 30.0


class NoiseModel(NamedTuple):
    """Variance of one photo's pixel: gain times its value, plus a floor (photo units).

    No variance is below `least`, that of rounding where it is known.
    """

    gain: float
    floor: float
    least: float = 0.0

    def variance(self, photo: Floats) -> Floats:
        """Return the variance of a pixel that reads `photo`; always above 0."""
        least = max(self.floor, self.least, 0.0) + 1e-12
        return np.asarray(np.maximum(self.gain * photo + self.floor, least))


def fit_noise(
    mean: Floats,
    variance: Floats,
    dark: float = 0.0,
    *,
    photos: int = 2,
    least: float = 0.0,
    typical: Callable[[Floats], float] = lambda values: float(np.median(values)),
) -> NoiseModel:
    """Fit shot and read noise to the scatter of photos that should be the same.

    A pattern and its inverse sum to the same picture in every pair, so the scatter of the sums
    is the noise of two photos: variance = gain * sum + 2 * floor (shot noise grows with light,
    read noise does not). A pattern that is projected again measures the noise of one photo.

    Parameters
    ----------
    mean, variance : ndarray
        Mean and variance at each camera pixel, photo units.
    dark : float
        Level of a photo under black. All of it may be a black level, which has no shot noise; the
        floor is therefore at least ``-gain * dark``. A flickering lamp, whose variance grows with
        the square of the light, would push the fit below that.
    photos : int
        How many photos each value sums.
    least : float
        Variance of rounding, which photos that are all the same do not show.
    typical : callable
        Reduces the variances of pixels of one brightness to one; by default their median, which
        is right where each variance is of many photos.

    Returns
    -------
    NoiseModel
    """
    # Bins of equal population: a few odd pixels (saturated, moving) drop out.
    order = np.argsort(mean, axis=None)
    rising, scatter = mean.ravel()[order], variance.ravel()[order]
    bins = min(64, len(order), max(2, len(order) // 64))
    level = np.array([np.median(part) for part in np.array_split(rising, bins)])
    binned = np.array([max(typical(part), least) for part in np.array_split(scatter, bins)])
    if np.ptp(level) <= 1e-9:
        return NoiseModel(0.0, float(np.mean(binned)) / photos, least)
    weight = 1.0 / np.maximum(binned, 1e-3 * binned.max(initial=0.0) + 1e-30)
    gain, offset = np.polyfit(level, binned, 1, w=weight)
    if gain < 0:
        return NoiseModel(0.0, float(np.median(binned)) / photos, least)
    return NoiseModel(float(gain), max(float(offset) / photos, -float(gain) * dark), least)


def variance_by_channel(models: Sequence[NoiseModel], photo: Floats) -> Floats:
    """Return the variance of a photo, (C, channels), by the model of each channel."""
    return np.stack([model.variance(photo[:, i]) for i, model in enumerate(models)], axis=1)


def mean_of_few(variances: Floats) -> float:
    """Return the mean of variances of a few photos each, without those of moving things.

    Their median would be far below their mean, the more so where the camera rounds coarsely.
    """
    ordered = np.sort(variances)
    quiet = ordered[: max(1, int(0.9 * len(ordered)))].mean()
    return float(ordered[ordered <= OUTLIER_FACTOR * quiet].mean())
