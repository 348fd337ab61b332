"""Light that changes during a shoot: lamp, exposure, or ambient light.

Photos of one pattern, and of a pattern and its inverse, show it, for their means are known.

Index convention: photos are (Cy, Cx, channels), raw levels.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.rigs.real.black_and_white import LIGHT_CHANGE_SHARE, BlackAndWhite, Levels

# Patterns whose mean is below this, of 255, show little of lamp and exposure.
DIM_MEAN_LEVEL = 64


class Deviation(NamedTuple):
    """A photo whose mean is not what earlier photos predict.

    Attributes
    ----------
    last_good : int or None
        The last photo whose mean was as predicted; None if there is none in the whole capture.
    share : float
        Excess over what was expected, as a share of what white adds to black.
    is_by_inverse : bool
        Whether a pattern and its inverse show it, and not the same pattern twice.
    """

    last_good: int | None
    share: float
    is_by_inverse: bool


class ExpectedLight:
    """Compares the mean of each photo of a shoot with what earlier photos predict.

    Parameters
    ----------
    levels : BlackAndWhite
    first : int
        Number of the first photo.
    """

    def __init__(self, levels: BlackAndWhite, first: int = 0) -> None:
        self._levels = levels
        self._compares_inverses = True
        self._means: dict[bytes, float] = {}
        self._last_good = first - 1

    def compare(self, number: int, pattern: NDArray[np.uint8], photo: Levels) -> Deviation | None:
        """Take in a photo of its pattern; return how its mean deviates, None if it does not."""
        mean = float(photo.mean(dtype=np.float64))
        key, inverse_key = pattern.tobytes(), (255 - pattern).tobytes()
        earlier, inverse = self._means.get(key), self._means.get(inverse_key)
        levels, is_by_inverse = self._levels, False
        if pattern.min() == pattern.max() and pattern[0, 0] in {0, 255}:
            end = levels.white if pattern[0, 0] else levels.black
            excess = mean - float(end.mean(dtype=np.float64))
        elif earlier is not None:
            excess = mean - earlier
        elif inverse is not None and self._compares_inverses:
            both = float(levels.white.mean(dtype=np.float64) + levels.black.mean(dtype=np.float64))
            excess, is_by_inverse = mean + inverse - both, True
        else:
            self._means[key] = mean
            return None
        self._means.setdefault(key, mean)
        share = excess / levels.contrast
        if abs(share) > LIGHT_CHANGE_SHARE:
            last_good = self._last_good if self._last_good >= 0 else None
            return Deviation(last_good, share, is_by_inverse)
        # Black shows nothing of lamp and exposure.
        if pattern.mean() > DIM_MEAN_LEVEL:
            self._last_good = number
        return None

    def ignore_inverses(self) -> None:
        """Stop comparing patterns with their inverses: they do not add up on this rig."""
        self._compares_inverses = False

    def start_again(self, levels: BlackAndWhite) -> None:
        """Forget earlier photos, after the light has changed."""
        self._levels = levels
        self._means.clear()
