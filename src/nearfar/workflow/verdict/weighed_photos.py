"""The error of relighting under a light that a weighted sum of photos shows.

Where the photos are of a light and of its inverse, their sum less white is noise, as for pairs of
check photos. Otherwise the variance of the noise is that of its model, and an error far below it
cannot be measured.

A lamp that is brighter in one photo than in another adds a share of white to the weighted sum, the
more the more photos are weighed. So the part of each difference that is proportional to white is
left out.

Index convention: pictures are (..., channels), any camera pixels.
"""

from dataclasses import dataclass

import numpy as np

from nearfar.arrays import Floats
from nearfar.workflow.verdict.check_pairs import LARGEST_NOISE_RATIO

# What the model of the noise may be off by, as a share of the noise's power.
NOISE_MODEL_ERROR = 0.1


@dataclass(frozen=True)
class WeighedPhotos:
    """A weighted sum of photos, compared with the relit picture of its light.

    Mean squares and products over camera pixels and channels, in photo units.

    Attributes
    ----------
    values : int
        Number of camera pixels times channels.
    signal : float
        The picture under the light.
    difference, difference_by_white : float
        The sum of photos less the relit picture: its square, and its product with white.
    white : float
        Square of the picture relit under white.
    noise : float
        Variance of the sum of photos by the model of their noise.
    of_mean, mean_by_white : float or None
        The mean of a photo and of the inverse's less black and half of white: its square, and its
        product with white. None without an inverse.
    error_of_white : float
        Mean square of the error of that half of white.
    """

    values: int
    signal: float
    difference: float
    difference_by_white: float
    white: float
    noise: float
    of_mean: float | None
    mean_by_white: float | None
    error_of_white: float

    def _without_white(self, square: float, by_white: float) -> float:
        """Return a mean square without the part that is proportional to white."""
        return square - by_white**2 / self.white if self.white > 0 else square

    @property
    def photo_noise(self) -> float:
        """Variance of the sum's noise."""
        if self.of_mean is None or self.mean_by_white is None:
            return self.noise
        # The mean of two photos has the noise of half of their difference.
        shown = self._without_white(self.of_mean, self.mean_by_white) - self.error_of_white
        shown = max(shown, 0.0)
        return min(shown, self.noise) if shown > LARGEST_NOISE_RATIO * self.noise else shown

    @property
    def error(self) -> float:
        """Mean square of the error under the light; by chance it may come out below 0."""
        return self._without_white(self.difference, self.difference_by_white) - self.photo_noise

    @property
    def error_deviation(self) -> float:
        """Standard deviation of `error`, from the noise of the photos."""
        values = max(1, self.values)
        share = np.hypot(np.sqrt(2 / values), NOISE_MODEL_ERROR)
        if self.of_mean is not None:
            # That of the difference, and as much again that of the mean.
            share = 2 / np.sqrt(values)
        return float(share * self.photo_noise)

    @property
    def excess_share(self) -> float:
        """Sum of the light's and the inverse's photo less white, as a share of white."""
        if self.mean_by_white is None or self.white <= 0:
            return 0.0
        return 2 * self.mean_by_white / self.white

    @property
    def excess_deviation(self) -> float:
        """Standard deviation of `excess_share`, from the noise of the photos."""
        if self.mean_by_white is None or self.white <= 0:
            return 0.0
        return float(2 * np.sqrt(self.photo_noise / max(1, self.values) / self.white))


def compare_weighed(
    shown: Floats,
    relit: Floats,
    *,
    level: float,
    white: Floats,
    noise: float,
    mean: Floats | None = None,
    error_of_white: float = 0.0,
) -> WeighedPhotos:
    """Compare a weighted sum of photos with the transport's picture.

    Parameters
    ----------
    shown, relit : ndarray, shape (..., channels)
        The weighted sum, and the picture under the light less `level`.
    level : float
    white : ndarray, shape (..., channels)
        The picture under white.
    noise, error_of_white : float
        As `WeighedPhotos`.
    mean : ndarray, shape (..., channels), optional
        The mean of the photos of a light and of its inverse, without black.
    """
    difference = (shown - relit).astype(np.float64)
    off = None if mean is None else (mean - white / 2).astype(np.float64)

    def by_white(values: Floats) -> float:
        return float(np.mean(values * white))

    return WeighedPhotos(
        values=difference.size,
        signal=float(np.mean(np.square(shown + level * white, dtype=np.float64))),
        difference=float(np.mean(difference**2)),
        difference_by_white=by_white(difference),
        white=by_white(white.astype(np.float64)),
        noise=noise,
        of_mean=None if off is None else float(np.mean(off**2)),
        mean_by_white=None if off is None else by_white(off),
        error_of_white=error_of_white,
    )
