"""The error of relighting under a pattern, by one photo of it and one of its inverse.

The two photos sum to white, which is photographed many times. The error of a transport has opposite
signs in the two photos less their relit pictures, so that the sum of these two differences is noise
alone. What the differences hold beyond that noise is the error. A model of the noise would not do:
the power of the error may be a twentieth of the noise's.

Index convention: pictures are (..., channels), any camera pixels.
"""

from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np

from nearfar.arrays import Floats

# Where the differences of a pair sum to this many times the power of the noise that the model
# expects, the sum is not noise alone, and the model's noise counts.
LARGEST_NOISE_RATIO = 1.2


@dataclass(frozen=True)
class CheckPair:
    """Photos of a check pattern and of its inverse, compared with their relit pictures.

    Mean squares over camera pixels and channels, in photo units.

    Attributes
    ----------
    values : int
        Number of camera pixels times channels.
    signal : float
        The pattern's photo without black.
    difference : float
        A photo less its relit picture, mean over the two photos.
    of_sum : float
        Sum of the two differences.
    excess : float
        Sum of the two differences; its mean, not its mean square.
    white : float
        Mean of the picture relit under white.
    noise : float
        Variance of one photo by the model of its noise.
    error_of_white : float
        Mean square of the error of the picture relit under white, as expected from the noise.
    share_of_pattern : float
        Expected power of the error under the pattern, over the mean of it and the inverse's.
    """

    values: int
    signal: float
    difference: float
    of_sum: float
    excess: float
    white: float
    noise: float
    error_of_white: float
    share_of_pattern: float

    @property
    def photo_noise(self) -> float:
        """Mean variance of one photo's noise."""
        # The sum of the differences is the noise of both photos and the error of white.
        shown = max(self.of_sum - self.error_of_white, 0.0) / 2
        return min(shown, self.noise) if shown > LARGEST_NOISE_RATIO * self.noise else shown

    @property
    def error(self) -> float:
        """Mean square of the error under the pattern; by chance it may come out below 0."""
        return self.share_of_pattern * (self.difference - self.photo_noise)

    @property
    def error_deviation(self) -> float:
        """Standard deviation of `error`, from the noise of the photos."""
        return float(self.share_of_pattern * self.photo_noise / np.sqrt(max(1, self.values)))

    @property
    def excess_share(self) -> float:
        """Sum of the pattern's and the inverse's photo less white, as a share of white."""
        return self.excess / self.white if self.white > 0 else 0.0

    @property
    def excess_deviation(self) -> float:
        """Standard deviation of `excess_share`, from the noise of the two photos."""
        if self.white <= 0:
            return 0.0
        return float(np.sqrt(2 * self.photo_noise / max(1, self.values)) / self.white)


class Means(Protocol):
    """A record of means over `values` values."""

    @property
    def values(self) -> int:
        """Number of values."""
        ...


Record = TypeVar("Record", bound=Means)


def over_both(one: Record, other: Record) -> Record:
    """Return the record of the camera pixels of two records; what is None stays None."""
    mine, theirs = vars(one), vars(other)
    values = one.values + other.values
    share = one.values / max(1, values)
    means = {
        name: None if mean is None else share * mean + (1 - share) * theirs[name]
        for name, mean in mine.items()
    }
    return type(one)(**means | {"values": values})


def compare_pair(
    shown: Floats,
    inverse: Floats,
    relit: Floats,
    *,
    white: Floats,
    noise: float,
    error_of_white: float,
    share_of_pattern: float = 1.0,
) -> CheckPair:
    """Compare the photos of a pattern and of its inverse with the transport's pictures.

    Parameters
    ----------
    shown, inverse : ndarray, shape (..., channels)
        The photos without black.
    relit, white : ndarray, shape (..., channels)
        The pictures under the pattern and under white.
    noise, error_of_white, share_of_pattern : float
        As `CheckPair`.
    """
    first = (shown - relit).astype(np.float64)
    second = (inverse - (white - relit)).astype(np.float64)
    both = first + second
    return CheckPair(
        values=first.size,
        signal=float(np.mean(np.square(shown, dtype=np.float64))),
        difference=float(np.mean(first**2) + np.mean(second**2)) / 2,
        of_sum=float(np.mean(both**2)),
        excess=float(both.mean()),
        white=float(np.mean(white, dtype=np.float64)),
        noise=noise,
        error_of_white=error_of_white,
        share_of_pattern=share_of_pattern,
    )
