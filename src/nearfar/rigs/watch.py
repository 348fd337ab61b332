"""Whether each photo is of its pattern, by the photos alone.

A photo that is not of its pattern shows, all over or in part, the pattern before: a frame that came
twice, was torn, or was taken before the projector had changed. So its rows equal those of the photo
before where the patterns differ. Photos of one pattern, and of a pattern and its inverse, tell
whether lamp, exposure or ambient light changed.

Index convention: photos are (Cy, Cx, channels), raw levels; bands are groups of rows.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, blocks
from nearfar.errors import DeviceError

BANDS = 16
# Photos this far apart in their noise's variance are of the same light, and so are photos that a
# lamp's flicker, as a share of what white adds to black, may set apart.
SAME = 2.5
FLICKER = 0.005
# A band tells patterns apart where white and black are so many variances apart.
TELLING = 100.0
# Of what white adds to black: a change of the light beyond this is told.
CHANGE = 0.02
# Patterns darker than this on average, of 255, say little of lamp and exposure.
DIM = 64
# So many photos that only looked like the one before, and it is the camera that is too coarse.
COARSE = 8

Levels = NDArray[Any]


class Ends(NamedTuple):
    """What a rig's photos are like: black and white, and the noise between them."""

    black: NDArray[np.float32]
    white: NDArray[np.float32]
    black_variance: float
    white_variance: float

    @property
    def contrast(self) -> float:
        """What white adds to black, mean level."""
        return float(self.white.mean() - self.black.mean())

    def variance(self, levels: Floats) -> Floats:
        """Variance of levels, by a line through black and white."""
        slope = (self.white_variance - self.black_variance) / max(self.contrast, 1e-9)
        above = np.clip(levels - self.black.mean(), 0.0, None)
        # Levels are whole numbers, and what is clipped has no noise at all.
        return np.asarray(np.maximum(self.black_variance + max(slope, 0.0) * above, 1 / 12))


def look_at_ends(blacks: list[Levels], whites: list[Levels]) -> Ends:
    """Learn black, white and noise from two photos of each.

    Raises
    ------
    DeviceError
        If white is no brighter than black.
    """
    black, white = (_mean(pair) for pair in (blacks, whites))
    noise = [_half_variance(*pair) for pair in (blacks, whites)]
    ends = Ends(black, white, *noise)
    if ends.contrast <= 3 * np.sqrt(max(noise[0], 1 / 12)):
        raise DeviceError(
            f"white looks like black to the camera (mean level {white.mean():.6g} after "
            f"{black.mean():.6g}): turn the projector on, open its shutter, and point the camera "
            f"at what it lights."
        )
    return ends


class Watch:
    """Follows a capture photo by photo.

    Parameters
    ----------
    ends : Ends
    """

    def __init__(self, ends: Ends) -> None:
        self.ends = ends
        contrast = (ends.white - ends.black) ** 2
        spread = ends.variance(ends.white) + ends.variance(ends.black)
        self._bands = [
            band
            for band in blocks(len(contrast), max(1, -(-len(contrast) // BANDS)))
            if contrast[band].mean() > TELLING * spread[band].mean()
        ]
        self._means: dict[bytes, tuple[int, float]] = {}
        self._before: tuple[bytes, Levels] | None = None
        self._mistaken = 0
        self._last_good = -1

    @property
    def coarse(self) -> bool:
        """Whether the camera does not tell neighbouring patterns apart, so that none can say."""
        return self._mistaken >= COARSE

    def begin(self, pattern: NDArray[np.uint8], photo: Levels) -> None:
        """Note what was photographed before the first photo."""
        self._before = (_key(pattern), photo)

    def suspect(self, pattern: NDArray[np.uint8], photo: Levels) -> str:
        """Say why a photo may not be of its pattern, in a few words; nothing if it is."""
        if self._before is None or self.coarse:
            return ""
        before, shown = self._before
        return "" if before == _key(pattern) else self.alike(shown, photo)

    def alike(self, one: Levels, other: Levels) -> str:
        """Say how two photos that should differ are alike; nothing if they are not."""
        same = [self._same(one[band], other[band]) for band in self._bands]
        if not same or not any(same):
            return ""
        if all(same):
            return "it is the photo before once more"
        # A tear goes through the whole width: all above it, or all below, is old.
        if same[0] or same[-1]:
            return "part of it is the photo before"
        return ""

    def agrees(self, one: Levels, other: Levels) -> bool:
        """Tell whether two photos are of the same light, within their noise."""
        return self._same(one, other)

    def mistaken(self) -> None:
        """Note that a suspect was innocent."""
        self._mistaken += 1

    def accept(self, number: int, pattern: NDArray[np.uint8], photo: Levels) -> tuple[int, float]:
        """Take in a photo that is of its pattern, and compare it with what it should add up to.

        Returns
        -------
        since : int
            The last photo at which light was as it should, -1 if none: the change came after it.
        change : float
            Light too much, or too little, as a share of what white adds to black; 0 where it cannot
            be told or is as it should.
        """
        key, mean = _key(pattern), float(photo.mean(dtype=np.float64))
        self._before = (key, photo)
        inverse = self._means.get(_key(255 - pattern))
        earlier = self._means.get(key)
        ends = self.ends
        both = float(ends.white.mean(dtype=np.float64) + ends.black.mean(dtype=np.float64))
        if pattern.min() == pattern.max() and pattern[0, 0] in {0, 255}:
            end = ends.white if pattern[0, 0] else ends.black
            change = mean - float(end.mean(dtype=np.float64))
        elif earlier is not None:
            change = mean - earlier[1]
        elif inverse is not None:
            change = mean + inverse[1] - both
        else:
            self._means[key] = (number, mean)
            return number, 0.0
        self._means.setdefault(key, (number, mean))
        share = change / ends.contrast
        if abs(share) > CHANGE:
            return self._last_good, share
        # Black tells nothing of lamp and exposure.
        if pattern.mean() > DIM:
            self._last_good = number
        return number, 0.0

    def start_again(self, ends: Ends) -> None:
        """Go on from light that has changed."""
        self.ends = ends
        self._means.clear()
        self._before = None

    def _same(self, one: Levels, other: Levels) -> bool:
        first, second = one.astype(np.float32), other.astype(np.float32)
        expected = self.ends.variance(first) + self.ends.variance(second)
        allowed = SAME * expected.mean() + (FLICKER * self.ends.contrast) ** 2
        return bool(((first - second) ** 2).mean() < allowed)


def _mean(photos: list[Levels]) -> NDArray[np.float32]:
    return np.asarray(np.stack(photos).mean(axis=0, dtype=np.float64), dtype=np.float32)


def _half_variance(one: Levels, other: Levels) -> float:
    difference = one.astype(np.float64) - other
    return float(np.var(difference) / 2)


def _key(pattern: NDArray[np.uint8]) -> bytes:
    return pattern.tobytes()
