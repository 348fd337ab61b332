"""Photos of black and white, and the noise in between.

Index convention: photos are (Cy, Cx, channels), raw levels.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats
from nearfar.errors import DeviceError
from nearfar.faults.records import LightChange

# Two photos are of the same light if their mean squared difference is below this multiple of their
# noise's variance, plus the square of a lamp's flicker, a share of what white adds to black.
SAME_LIGHT_VARIANCE_RATIO = 2.5
FLICKER_SHARE = 0.005
# White is visible where it is this many standard deviations above black.
VISIBLE_DEVIATIONS = 6.0
# No variance is below this, as a share of the square of what white adds to black.
RELATIVE_VARIANCE_FLOOR = 1e-10
# Light has changed where it differs by this share of what white adds to black.
LIGHT_CHANGE_SHARE = 0.02
# A photo's mean is that of black, or of white, if it is closer to it than this share of what white
# adds to black.
MEAN_SHARE = 0.1

Levels = NDArray[Any]


class BlackAndWhite(NamedTuple):
    """Photos of black and white, and their noise.

    Attributes
    ----------
    black, white : array
        Mean photos, float32.
    black_variance, white_variance : float
        Of the noise, in levels squared.
    rounding_variance : float
        Of rounding to whole levels.
    """

    black: NDArray[np.float32]
    white: NDArray[np.float32]
    black_variance: float
    white_variance: float
    rounding_variance: float

    @property
    def contrast(self) -> float:
        """Mean level of white over black."""
        return float(self.white.mean() - self.black.mean())

    def variance(self, levels: Floats) -> Floats:
        """Return the noise's variance at some levels, by a line through black and white."""
        slope = (self.white_variance - self.black_variance) / max(self.contrast, 1e-9)
        above = np.clip(levels - self.black.mean(), 0.0, None)
        # Clipped values have no noise at all.
        least = max(self.rounding_variance, RELATIVE_VARIANCE_FLOOR * self.contrast**2)
        return np.asarray(np.maximum(self.black_variance + max(slope, 0.0) * above, least))

    def is_same_light(self, one: Levels, other: Levels) -> bool:
        """Return whether two photos, or the same part of both, differ by noise alone."""
        first, second = one.astype(np.float32), other.astype(np.float32)
        expected = self.variance(first) + self.variance(second)
        flicker = (FLICKER_SHARE * self.contrast) ** 2
        allowed = SAME_LIGHT_VARIANCE_RATIO * expected.mean() + flicker
        return bool(((first - second) ** 2).mean() < allowed)

    def has_mean_of(self, known: NDArray[np.float32], photo: Levels) -> bool:
        """Return whether a photo's mean is that of black, or of white, whichever is given."""
        return bool(abs(float(photo.mean()) - float(known.mean())) < MEAN_SHARE * self.contrast)

    def change_to(self, now: "BlackAndWhite") -> LightChange | None:
        """Return how the light has changed since; None where it has not."""
        dark = float(now.black.mean() - self.black.mean()) / self.contrast
        lamp = now.contrast / self.contrast - 1
        if abs(lamp) > abs(dark) and abs(lamp) > LIGHT_CHANGE_SHARE / 2:
            return LightChange("lamp", lamp)
        if abs(dark) > LIGHT_CHANGE_SHARE / 2:
            return LightChange("ambient", dark)
        return None


def measure_black_and_white(blacks: list[Levels], whites: list[Levels]) -> BlackAndWhite:
    """Measure black, white and their noise by two photos of each.

    Raises
    ------
    DeviceError
        If white is no brighter than black.
    """
    black, white = (_mean(pair) for pair in (blacks, whites))
    noise = [_noise_variance(*pair) for pair in (blacks, whites)]
    rounding = 1 / 12 if blacks[0].dtype.kind in "iu" else 0.0
    found = BlackAndWhite(black, white, noise[0], noise[1], rounding)
    # Where it is brightest: the projector may light a small part of the view.
    brightest = float(np.quantile(white - black, 0.999))
    visible = VISIBLE_DEVIATIONS * np.sqrt(max(noise[0], rounding))
    if found.contrast <= 0 or brightest <= visible:
        raise DeviceError(
            f"white looks like black to the camera (mean level {white.mean():.6g} under white, "
            f"{black.mean():.6g} under black): turn the projector on, open its shutter, and point "
            f"the camera at what it lights."
        )
    return found


def agree_in_mean(blacks: list[Levels], whites: list[Levels]) -> bool:
    """Return whether the photos of black have the same mean, and those of white."""
    both = (blacks, whites)
    pairs = np.array([[photo.mean(dtype=np.float64) for photo in pair] for pair in both])
    contrast = abs(float(np.ptp(pairs.mean(axis=1))))
    return bool((np.ptp(pairs, axis=1) <= LIGHT_CHANGE_SHARE * max(contrast, 1e-9)).all())


def _mean(photos: list[Levels]) -> NDArray[np.float32]:
    return np.asarray(np.stack(photos).mean(axis=0, dtype=np.float64), dtype=np.float32)


def _noise_variance(one: Levels, other: Levels) -> float:
    difference = one.astype(np.float64) - other
    return float(np.var(difference) / 2)
