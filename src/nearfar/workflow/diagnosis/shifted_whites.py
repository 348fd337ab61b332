"""Motion of the camera by a pixel or more, or there and back, told by the photos of white alone.

All photos of white are of one pattern, so where the camera moved they are shifted copies of each
other. An estimate from photos before and after a motion by a pixel fits neither, and tells nothing
of it. Each white is registered to the first by phase correlation (Kuglin and
Hines, "The phase correlation image alignment method", 1975). Between two whites of different shift,
photos tell the moment by themselves: a photo over the white of its own place is smooth where the
albedo has edges, over the other one it is not.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import fft, ndimage

from nearfar.arrays import Floats, Integers
from nearfar.capture import Capture
from nearfar.faults.of_photos import Moved
from nearfar.photometry.drift import References

# Rows and columns of the middle of the camera that are compared, at most.
MOST_SIDE = 1024
# Camera pixels of the least shift that is told, and of the least one that stays: regressions tell
# the moment of smaller ones better.
LEAST_SHIFT, LEAST_THAT_STAYS = 0.15, 0.7
# Two photos of an even wall correlate by chance, with a peak of up to 7.5 standard deviations.
# Shifted pictures were seen to peak at 12 and more, and with few pixels at 0.78 of the highest that
# there is.
LEAST_PEAK_DEVIATIONS, LEAST_PEAK = 10.0, 0.6
# Gauss-Newton steps from the peak of the correlation, which is some tenths of a pixel off.
REFINEMENTS = 4
# A shift leaves at most this share of the squared difference of two whites.
LARGEST_SHARE_LEFT = 0.25
# Light of white that photos are divided by, as a share of its mean.
LEAST_WHITE = 0.2


class Shift(NamedTuple):
    """Camera pixels down and across from one picture to another."""

    down: float
    across: float

    @property
    def pixels(self) -> float:
        """How far."""
        return float(np.hypot(self.down, self.across))


def find_shifted_whites(capture: Capture, references: References) -> list[Moved]:
    """Find where the camera moved by a pixel or more, or moved and was back at a later white.

    Parameters
    ----------
    capture : Capture
    references : References
        Of its plan.

    Returns
    -------
    list of Moved
        Empty, or the first motion of the camera.

    Raises
    ------
    UnreadableFileError
        If photos are damaged.
    """
    whites: Integers = references.whites
    # Not the same black of both: its noise would be theirs alike, and not be shifted.
    first_black, black = (_middle_of(capture, int(references.blacks[end])) for end in (0, -1))
    pictures = [
        _middle_of(capture, int(white)) - (black if number else first_black)
        for number, white in enumerate(whites)
    ]
    shifts = [shift_between(pictures[0], picture) for picture in pictures[1:]]
    moved = np.array([False, *(shift is not None for shift in shifts)])
    if not moved.any():
        return []
    first = int(np.argmax(moved))
    shift = shifts[first - 1]
    assert shift is not None
    back = first + int(np.argmin(moved[first:]))
    if back == first and shift.pixels < LEAST_THAT_STAYS:
        return []
    photo = _moment(capture, black, whites[first - 1 : first + 1], pictures[first - 1 : first + 1])
    until = None
    if back > first:
        until = _moment(capture, black, whites[back - 1 : back + 1], pictures[back - 1 : back + 1])
    return [Moved("camera", photo, shift.pixels, until)]


def shift_between(one: Floats, other: Floats) -> Shift | None:
    """Return the shift that makes one picture the other, if there is one.

    Parameters
    ----------
    one, other : ndarray, shape (y, x)

    Returns
    -------
    Shift or None
        None if they are not shifted, or by less than `LEAST_SHIFT`, or differ otherwise.
    """
    found = _peak_of_correlation(one, other)
    if found is None:
        return None
    margin = int(np.ceil(np.abs(found).max())) + 1
    if 4 * margin > min(one.shape):
        return None
    # One may be brighter than the other.
    scaled = one * (np.vdot(one, other) / max(float(np.vdot(one, one)), 1e-300))
    inner = (slice(margin, -margin),) * 2
    unshifted = (other - scaled)[inner]
    shifted = unshifted
    for _ in range(REFINEMENTS):
        if np.hypot(*found) < LEAST_SHIFT / 3:
            return None
        moved = ndimage.shift(scaled, found, order=3, mode="nearest")
        shifted = (other - moved)[inner]
        slopes = np.stack([-slope[inner].ravel() for slope in np.gradient(moved)], axis=1)
        step, *_ = np.linalg.lstsq(slopes, shifted.ravel(), rcond=None)
        found = found + np.clip(step, -1, 1)
    left = float(np.vdot(shifted, shifted)) / max(float(np.vdot(unshifted, unshifted)), 1e-300)
    shift = Shift(*found.tolist())
    return shift if left < LARGEST_SHARE_LEFT and shift.pixels > LEAST_SHIFT else None


def _middle_of(capture: Capture, number: int) -> Floats:
    """Return the middle of a photo, mean over channels, (y, x)."""
    height, width = capture.camera
    top, left = max(0, (height - MOST_SIDE) // 2), max(0, (width - MOST_SIDE) // 2)
    (photo,) = capture.read([number], slice(top, top + min(height, MOST_SIDE)))
    return np.asarray(photo[:, left : left + MOST_SIDE].mean(axis=-1))


def _peak_of_correlation(one: Floats, other: Floats) -> NDArray[np.float64] | None:
    """Return the place of the phase correlation's peak, between pixels, (2,); None by chance."""
    window = np.hanning(one.shape[0])[:, None] * np.hanning(one.shape[1])
    first, second = (fft.rfft2((each - each.mean()) * window) for each in (one, other))
    spectrum = first.conj() * second
    spectrum /= np.abs(spectrum) + 1e-12 * np.abs(spectrum).max() + np.finfo(np.float32).tiny
    found = fft.irfft2(spectrum, one.shape)
    if found.max() < min(LEAST_PEAK_DEVIATIONS / np.sqrt(found.size), LEAST_PEAK):
        return None
    peak = np.unravel_index(int(found.argmax()), found.shape)
    place = np.empty(2)
    for axis, at in enumerate(peak):
        line = np.take(found, peak[1 - axis], axis=1 - axis)
        before, here, after = line[(int(at) + np.arange(-1, 2)) % len(line)]
        bend = before - 2 * here + after
        step = (before - after) / (2 * bend) if bend < 0 else 0.0
        place[axis] = (at + step + len(line) / 2) % len(line) - len(line) / 2
    return place


def _moment(capture: Capture, black: Floats, numbers: Integers, pictures: Sequence[Floats]) -> int:
    """Return the first photo that is at the place of the second of two whites."""
    least = LEAST_WHITE * np.mean([picture.mean() for picture in pictures])
    bright = np.logical_and(*(picture > least for picture in pictures))
    over = [np.where(bright, picture, np.inf) for picture in pictures]
    between = np.arange(int(numbers[0]) + 1, int(numbers[1]))
    rougher_over_first = np.empty(len(between))
    for place, number in enumerate(between.tolist()):
        photo = _middle_of(capture, number) - black
        first, second = (_roughness(photo / white) for white in over)
        rougher_over_first[place] = (first - second) / max(first + second, 1e-300)
    # The sum of those before the moment is least.
    sums = np.concatenate([[0.0], np.cumsum(rougher_over_first)])
    return int(numbers[0]) + 1 + int(np.argmin(sums))


def _roughness(picture: Floats) -> float:
    """Return the mean absolute second difference."""
    return float(sum(np.abs(np.diff(picture, 2, axis=axis)).mean() for axis in (0, 1)))
