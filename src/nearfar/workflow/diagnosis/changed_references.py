"""What the photos of white and black tell by themselves, as no two of them should differ.

White and black are shown again and again through a capture. Without drift all photos of one of them
are alike but for noise, however well an estimate fits. So these photos tell of an object that moved
by a small part of a pixel, of dust, and of light that runs in bands over the rows of the camera.

Index convention: arrays are (photos, rows, columns, channels); the photos are those of one pattern.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Integers
from nearfar.faults.of_light import NoisyRows, RowsFlicker
from nearfar.faults.of_photos import PixelsFlash, SceneChanged
from nearfar.photometry.drift import References
from nearfar.workflow.diagnosis.misfit import SteadyPhotos

# Fewer photos of a pattern do not tell a change from noise.
FEWEST = 3
# Variance between the photos before a change and those after it, over the variance among them: 1 if
# nothing changed. docs/decisions/0114 has what good captures reach.
LEAST_VARIANCE_RATIO = 1.25
# What one value of a camera pixel counts at most in that.
LARGEST_OF_VALUE = 16.0
# The same by chance: so many standard deviations above 1.
SURE_DEVIATIONS = 8.0
# Root mean square of a change, as a share of white's, that is told.
SMALLEST_CHANGE = 0.003
# Variance of the means of rows, over what noise makes of it, and over that of the means of columns.
LEAST_OF_ROWS, LEAST_OVER_COLUMNS = 5.0, 5.0
# Bands of black over those of white that are there in the dark too.
LEAST_IN_THE_DARK = 0.5
# A camera pixel flashes in a photo that differs from the median of all by more than the first, in
# standard deviations, where the second largest difference is less than the second.
FLASH, QUIET = 10.0, 5.0
# By this share of white, at least, and by so many levels of photos that are rounded, where noise
# may not show.
FLASH_OF_WHITE, FLASH_OF_LEVELS = 0.01, 3.5
# Median of the sizes of normal numbers of standard deviation 1.
MEDIAN_OF_NORMAL = 0.6745
# Photos in which some camera pixels flash: what happens once is in fewer.
FEWEST_FLASHING = 3


class Change(NamedTuple):
    """The change between two photos of a pattern that explains most.

    Attributes
    ----------
    place : int
        Of the first photo after it.
    ratio : float
        Variance between the photos before and after it over that among them.
    size : float
        Root mean square, in photo units; what noise makes of it is taken off.
    left : ndarray, shape (photos, rows, columns, channels)
        Differences from the mean of the photos before it, or after it, in standard deviations of
        the noise.
    """

    place: int
    ratio: float
    size: float
    left: NDArray[np.float64]


def find_flashing_pixels(
    photos: SteadyPhotos, taken: Floats, references: References
) -> list[PixelsFlash]:
    """Find whether camera pixels flash in single photos of white or of black.

    Parameters
    ----------
    photos : SteadyPhotos
        Of a sample.
    taken : ndarray, shape (photos, rows, columns, channels)
        The same as they were taken, which tells how coarsely they are rounded.
    references : References
    """
    white, black = _all_repeats(photos, references)
    if white is None:
        return []
    levels = np.unique(taken[np.concatenate(references)])
    step = float(np.diff(levels).min(initial=np.inf)) if len(levels) > 1 else 0.0
    least = max(FLASH_OF_WHITE * _light(white), FLASH_OF_LEVELS * step)
    flashing = np.concatenate(
        [_flashing_shares(each, least) for each in (white, black) if each is not None]
    )
    if np.count_nonzero(flashing) < FEWEST_FLASHING:
        return []
    return [PixelsFlash(float(flashing.mean()))]


def find_changed_references(
    photos: SteadyPhotos, references: References
) -> list[RowsFlicker | NoisyRows | SceneChanged]:
    """Find what changed from one photo of white, or of black, to another.

    Parameters
    ----------
    photos : SteadyPhotos
        Of a sample.
    references : References

    Returns
    -------
    list of RowsFlicker, NoisyRows or SceneChanged
        Bands of rows, else a change at one moment, if any is found.
    """
    white, black = _all_repeats(photos, references)
    of_white, of_black = _bands(white), _bands(black)
    if white is None:
        return []
    if deviation := max(of_white, of_black):
        kind = NoisyRows if of_black > LEAST_IN_THE_DARK * of_white else RowsFlicker
        return [kind(deviation / _light(white))]
    change, values = _best_change(white), int(np.count_nonzero(white.usable))
    least = max(LEAST_VARIANCE_RATIO, 1 + SURE_DEVIATIONS * float(np.sqrt(2 / values)))
    if change.ratio > least and change.size > SMALLEST_CHANGE * _light(white):
        after, before = references.whites[change.place - 1 : change.place + 1].tolist()
        return [SceneChanged(after, before)]
    return []


class _Repeats(NamedTuple):
    """Photos of one pattern.

    Attributes
    ----------
    differences : ndarray, shape (photos, rows, columns, channels)
        From their mean, in standard deviations of the noise; 0 where they are not usable.
    mean, deviation : ndarray, shape (rows, columns, channels)
        Mean, and standard deviation of the noise of a photo.
    usable : ndarray of bool, shape (rows, columns, channels)
    """

    differences: NDArray[np.float64]
    mean: NDArray[np.float64]
    deviation: NDArray[np.float64]
    usable: Booleans


def _all_repeats(
    photos: SteadyPhotos, references: References
) -> tuple[_Repeats | None, _Repeats | None]:
    """Return the photos of white, and those of black."""
    white, black = (_repeats(photos, numbers) for numbers in references)
    return white, black


def _light(white: _Repeats) -> float:
    """Return the root mean square of white."""
    return max(float(np.sqrt(np.mean(white.mean**2))), 1e-12)


def _repeats(photos: SteadyPhotos, numbers: Integers) -> _Repeats | None:
    """Return the photos of one pattern; None if there are too few that differ."""
    if len(numbers) < FEWEST:
        return None
    rows = slice(0, len(photos.unsaturated))
    exact = photos.read(numbers.tolist(), rows).astype(np.float64)
    mean = exact.mean(axis=0)
    flat = mean.reshape(-1, mean.shape[-1]).astype(np.float32)
    deviation = np.sqrt(photos.variance(flat).astype(np.float64)).reshape(mean.shape)
    usable = photos.unsaturated[rows] & np.isfinite(deviation) & (exact.std(axis=0) > 0)
    usable &= deviation > 0
    if not usable.any():
        return None
    differences = np.where(usable, (exact - mean) / np.where(usable, deviation, 1.0), 0.0)
    return _Repeats(differences, mean, deviation, usable)


def _best_change(repeats: _Repeats) -> Change:
    """Return the change at one moment that explains most of the differences."""
    differences, values = repeats.differences, np.count_nonzero(repeats.usable)
    count = len(differences)
    best: Change | None = None
    for place in range(1, count):
        step = differences[place:].mean(axis=0) - differences[:place].mean(axis=0)
        after = (np.arange(count) >= place)[:, None, None, None]
        left = differences - np.where(after, place / count, place / count - 1) * step
        among = float(np.sum(left**2)) / values / (count - 2)
        # The variance of the mean of the photos before, plus that of those after.
        by_noise = count / (place * (count - place))
        of_values = step**2 / (by_noise * max(among, 1e-300))
        # So the few camera pixels that flash once do not make a change.
        ratio = float(np.sum(np.minimum(of_values, LARGEST_OF_VALUE))) / values
        if best is None or ratio > best.ratio:
            squares = (step**2 - among * by_noise)[repeats.usable]
            size = squares * repeats.deviation[repeats.usable] ** 2
            best = Change(place, ratio, float(np.sqrt(max(0.0, np.mean(size)))), left)
    assert best is not None
    return best


def _bands(repeats: _Repeats | None) -> float:
    """Return the standard deviation of the means of rows, in photo units.

    It is 0 unless rows differ as a whole from photo to photo, by no change at one moment.
    """
    if repeats is None:
        return 0.0
    left, usable = _best_change(repeats).left, repeats.usable
    noise = np.sum(left**2) / np.count_nonzero(usable)
    of_rows, of_columns = (
        float(
            np.mean(
                np.sum(left, axis=axes) ** 2 / np.maximum(1, np.sum(usable, axis=of)), axis=1
            ).sum()
        )
        / max(float(noise), 1e-300)
        for axes, of in (((2, 3), (1, 2)), ((1, 3), (0, 2)))
    )
    if of_rows < max(LEAST_OF_ROWS, LEAST_OVER_COLUMNS * of_columns):
        return 0.0
    of_values = left * np.where(usable, repeats.deviation, 0.0)
    means = of_values.sum(axis=(2, 3)) / np.maximum(1, usable.sum(axis=(1, 2)))
    return float(np.sqrt(np.sum(means**2) / means.shape[1] / (len(left) - 2)))


def _flashing_shares(repeats: _Repeats, least: float) -> NDArray[np.float64]:
    """Return the share of the camera pixels that flash by at least so much, of each photo."""
    differences = repeats.differences - np.median(repeats.differences, axis=0)
    # Flashes are part of what the model takes for noise: medians tell it without. That of the whole
    # picture counts where the model has less, as in the dark.
    in_photo_units = differences * repeats.deviation
    noise, of_picture = (
        float(np.median(np.abs(each[:, repeats.usable]))) / MEDIAN_OF_NORMAL
        for each in (differences, in_photo_units)
    )
    if not noise > 0:
        # Most values do not change, as where photos are rounded coarsely.
        return np.zeros(len(differences))
    scale = np.maximum(noise * repeats.deviation, of_picture)
    differences = np.where(repeats.usable, in_photo_units / scale, 0.0)
    sizes = np.sort(np.abs(differences), axis=0)
    flashes = (np.abs(differences) > FLASH) & (sizes[-2] < QUIET)
    flashes &= np.abs(in_photo_units) > least
    pixels = np.count_nonzero(repeats.usable.any(axis=2))
    return np.asarray(flashes.any(axis=3).sum(axis=(1, 2)) / pixels)
