"""Several frames of the same light combined: averages, and exposures of several lengths.

Index convention: frames are (n, ...), raw levels; whatever follows is a frame's own shape.
"""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats

# Share of full scale up to which levels are linear: the brightest bend before they clip.
LARGEST_TRUSTED_SHARE = 0.98


class Sensor(NamedTuple):
    """Model of a camera's levels: level = black + gain * electrons, with noise.

    Attributes
    ----------
    black : float
        Level without light.
    gain : float
        Levels per electron.
    read : float
        Standard deviation of a reading, levels.
    """

    black: float = 0.0
    gain: float = 1.0
    read: float = 1.0

    def variance(self, levels: Floats) -> Floats:
        """Variance of levels, in levels squared: shot noise and read noise."""
        return np.asarray(self.read**2 + self.gain * np.maximum(levels - self.black, 0.0))


def average(frames: Iterable[NDArray[Any]], full_scale: float) -> NDArray[np.float32]:
    """Average frames; a value that is saturated in one of them stays so.

    Parameters
    ----------
    frames : iterable of arrays
        Of one shape, light and exposure; one is in memory at a time.
    full_scale : float

    Returns
    -------
    array
        float32, levels.
    """
    count, total, saturated = 0, np.zeros(()), np.zeros((), dtype=bool)
    for frame in frames:
        count, total = count + 1, total + frame
        saturated = saturated | (frame >= full_scale)
    return np.asarray(np.where(saturated, full_scale, total / count), dtype=np.float32)


def merge_exposures(
    frames: NDArray[Any], times: Sequence[float], sensor: Sensor, full_scale: float
) -> NDArray[np.float32]:
    """Merge exposures of several lengths, each weighted by the inverse of its variance.

    The rate of light that best explains all levels that are not clipped is
    sum(w (level - black) / t) / sum(w) with w = t^2 / variance. The variance is that of the level
    that a first estimate of the rate predicts, so that weights do not follow the noise.

    Parameters
    ----------
    frames : array, shape (n, ...)
        The first is the shortest.
    times : sequence of float
        Exposure of each.
    sensor : Sensor
        For the weights.
    full_scale : float
        Level at which a value is saturated.

    Returns
    -------
    array
        float32: levels as of the first exposure; `full_scale` where even that is saturated.
    """
    lengths = np.asarray(times, dtype=np.float64).reshape(-1, *(1,) * (frames.ndim - 1))
    trusted = frames < LARGEST_TRUSTED_SHARE * full_scale
    light = frames.astype(np.float64) - sensor.black
    # Without read noise this would be the result.
    time = (trusted * lengths).sum(axis=0)
    rate = (trusted * light).sum(axis=0) / np.where(time > 0, time, 1.0)
    weight = trusted * lengths**2 / sensor.variance(rate * lengths + sensor.black)
    total = weight.sum(axis=0)
    rate = (weight * light / lengths).sum(axis=0) / np.where(total > 0, total, 1.0)
    levels = sensor.black + rate * lengths[0]
    # Where even the shortest exposure is not trusted, its level is kept.
    return np.asarray(np.where(total > 0, levels, frames[0]), dtype=np.float32)
