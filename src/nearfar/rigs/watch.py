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
# White is seen where it is so many deviations above black.
SEEN = 6.0
# No noise is less than this, as a share of what white adds to black, squared.
TINY = 1e-10
# Of what white adds to black: a change of the light beyond this is told.
CHANGE = 0.02
# Patterns darker than this on average, of 255, say little of lamp and exposure.
DIM = 64
# So many photos, and this share of all, that only looked like the one before, and it is the camera
# that is too coarse.
COARSE = 8
OFTEN = 0.25
# A band sees direct light where the halves of white differ by this share of white's own difference
# from black: what is lit by the scene alone hardly knows which half is lit.
DIRECT = 0.5
# A pattern changes everywhere if in each of so many groups of its rows and columns at least this
# share of pixels changes by so many levels.
GROUPS = 4
CHANGED = 0.1
STEP = 25

Levels = NDArray[Any]


class Ends(NamedTuple):
    """What a rig's photos are like: black and white, and the noise between them."""

    black: NDArray[np.float32]
    white: NDArray[np.float32]
    black_variance: float
    white_variance: float
    # Variance of rounding to whole numbers.
    rounding: float

    @property
    def contrast(self) -> float:
        """What white adds to black, mean level."""
        return float(self.white.mean() - self.black.mean())

    def variance(self, levels: Floats) -> Floats:
        """Variance of levels, by a line through black and white."""
        slope = (self.white_variance - self.black_variance) / max(self.contrast, 1e-9)
        above = np.clip(levels - self.black.mean(), 0.0, None)
        # What is clipped has no noise at all.
        least = max(self.rounding, TINY * self.contrast**2)
        return np.asarray(np.maximum(self.black_variance + max(slope, 0.0) * above, least))


def look_at_ends(blacks: list[Levels], whites: list[Levels]) -> Ends:
    """Learn black, white and noise from two photos of each.

    Raises
    ------
    DeviceError
        If white is no brighter than black.
    """
    black, white = (_mean(pair) for pair in (blacks, whites))
    noise = [_half_variance(*pair) for pair in (blacks, whites)]
    rounding = 1 / 12 if blacks[0].dtype.kind in "iu" else 0.0
    ends = Ends(black, white, noise[0], noise[1], rounding)
    # Where it is brightest: the projector may light a small part of the view.
    brightest = float(np.quantile(white - black, 0.999))
    if ends.contrast <= 0 or brightest <= SEEN * np.sqrt(max(noise[0], rounding)):
        raise DeviceError(
            f"white looks like black to the camera (mean level {white.mean():.6g} after "
            f"{black.mean():.6g}): turn the projector on, open its shutter, and point the camera "
            f"at what it lights."
        )
    return ends


def are_alike(blacks: list[Levels], whites: list[Levels]) -> bool:
    """Tell whether photos of black are as light as one another, and those of white."""
    both = (blacks, whites)
    pairs = np.array([[photo.mean(dtype=np.float64) for photo in pair] for pair in both])
    contrast = abs(float(np.ptp(pairs.mean(axis=1))))
    return bool((np.ptp(pairs, axis=1) <= CHANGE * max(contrast, 1e-9)).all())


def difference(old: Ends, now: Ends) -> str:
    """Say in words what has changed of the light; nothing where it is as it was."""
    dark = float(now.black.mean() - old.black.mean()) / old.contrast
    lamp = now.contrast / old.contrast - 1
    if abs(lamp) > abs(dark) and abs(lamp) > CHANGE / 2:
        return f"exposure or lamp changed by {lamp:+.1%}"
    if abs(dark) > CHANGE / 2:
        return f"ambient light changed by {dark:+.1%} of white"
    return ""


def shows(photo: Levels, known: NDArray[np.float32], ends: Ends) -> bool:
    """Tell whether a photo's mean is what is known of its frame."""
    return bool(abs(float(photo.mean()) - float(known.mean())) < 0.1 * ends.contrast)


class Change(NamedTuple):
    """Light that is not as it should be.

    Attributes
    ----------
    since : int
        The last photo at which it was, one less than the first if none: the change came after it.
    share : float
        Light too much, or too little, as a share of what white adds to black.
    by_inverse : bool
        Whether a pattern and its inverse tell of it, and not the same pattern twice.
    """

    since: int
    share: float
    by_inverse: bool


class Watch:
    """Follows a capture photo by photo.

    Parameters
    ----------
    ends : Ends
    first : int
        Number of the first photo that is to come.
    """

    def __init__(self, ends: Ends, first: int = 0) -> None:
        self.ends = ends
        self._seen = 0
        self._inverses = True
        contrast = (ends.white - ends.black) ** 2
        spread = ends.variance(ends.white) + ends.variance(ends.black)
        self._bands = [
            band
            for band in blocks(len(contrast), max(1, -(-len(contrast) // BANDS)))
            if contrast[band].mean() > TELLING * spread[band].mean()
        ]
        self._means: dict[bytes, tuple[int, float]] = {}
        self._before: tuple[NDArray[np.uint8], Levels] | None = None
        self._mistaken = 0
        self._coarse = self._everywhere = False
        self._last_good = first - 1

    @property
    def coarse(self) -> bool:
        """Whether the camera does not tell neighbouring patterns apart, so that none can say."""
        return self._coarse

    def begin(self, pattern: NDArray[np.uint8], photo: Levels) -> None:
        """Note what was photographed before the next photo, of white or of a half of it."""
        self._before = (pattern, photo)
        self._everywhere = True

    def learn_bands(self, left: Levels, right: Levels) -> None:
        """Learn from photos of the left half of white and of the right where light is direct."""
        halves = (left.astype(np.float32) - right) ** 2
        contrast = (self.ends.white - self.ends.black) ** 2
        direct = [b for b in self._bands if halves[b].mean() > DIRECT**2 * contrast[b].mean()]
        self._bands = direct or self._bands

    def suspect(self, pattern: NDArray[np.uint8], photo: Levels) -> str:
        """Say why a photo may not be of its pattern, in a few words; nothing if it is."""
        if self._before is None or self.coarse:
            return ""
        before, shown = self._before
        if np.array_equal(before, pattern):
            return ""
        return self.alike(
            shown, photo, torn=self._everywhere or _differ_everywhere(before, pattern)
        )

    def alike(self, one: Levels, other: Levels, *, torn: bool = True) -> str:
        """Say how two photos that should differ are alike; nothing if they are not.

        Parameters
        ----------
        one, other : array
        torn : bool
            Whether they should differ everywhere, so that a part that is alike tells of a tear.
        """
        same = [self._same(one[band], other[band]) for band in self._bands]
        if not same or not any(same):
            return ""
        if all(same):
            return "it is the photo before once more"
        # A tear goes through the whole width: all above it, or all below, is old.
        if torn and (same[0] or same[-1]):
            return "part of it is the photo before"
        return ""

    def agrees(self, one: Levels, other: Levels) -> bool:
        """Tell whether two photos are of the same light, within their noise."""
        return self._same(one, other)

    def mistaken(self) -> None:
        """Note that a suspect was innocent."""
        self._mistaken += 1
        self._coarse = self._coarse or self._mistaken >= max(COARSE, OFTEN * self._seen)

    def accept(self, number: int, pattern: NDArray[np.uint8], photo: Levels) -> Change | None:
        """Take in a photo that is of its pattern, and compare it with what it should add up to.

        Returns
        -------
        Change or None
            None where nothing can be told, or all is as it should be.
        """
        self._seen += 1
        key, mean = _key(pattern), float(photo.mean(dtype=np.float64))
        self._before = (pattern, photo)
        self._everywhere = False
        inverse = self._means.get(_key(255 - pattern))
        earlier = self._means.get(key)
        ends, by_inverse = self.ends, False
        if pattern.min() == pattern.max() and pattern[0, 0] in {0, 255}:
            end = ends.white if pattern[0, 0] else ends.black
            change = mean - float(end.mean(dtype=np.float64))
        elif earlier is not None:
            change = mean - earlier[1]
        elif inverse is not None and self._inverses:
            both = float(ends.white.mean(dtype=np.float64) + ends.black.mean(dtype=np.float64))
            change, by_inverse = mean + inverse[1] - both, True
        else:
            self._means[key] = (number, mean)
            return None
        self._means.setdefault(key, (number, mean))
        share = change / ends.contrast
        if abs(share) > CHANGE:
            return Change(self._last_good, share, by_inverse)
        # Black tells nothing of lamp and exposure.
        if pattern.mean() > DIM:
            self._last_good = number
        return None

    def forget_inverses(self) -> None:
        """Compare patterns with their inverses no more: they do not add up on this rig."""
        self._inverses = False

    def start_again(self, ends: Ends) -> None:
        """Go on from light that has changed."""
        self.ends = ends
        self._means.clear()

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


def _differ_everywhere(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> bool:
    """Tell whether two patterns differ in all groups of rows and of columns."""
    changed = np.abs(one.astype(np.int16) - other) > STEP
    return all(
        part.mean() >= CHANGED
        for axis in (0, 1)
        for part in np.array_split(changed, min(GROUPS, changed.shape[axis]), axis=axis)
    )


def _key(pattern: NDArray[np.uint8]) -> bytes:
    return pattern.tobytes()
