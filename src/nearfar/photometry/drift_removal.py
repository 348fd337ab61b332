"""Photos by reference without the drift of lamp and ambient light, and a model of their noise.

Index convention: arrays are (photos, C, channels) with C camera pixels row by row; i runs over
channels.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers
from nearfar.errors import InputError
from nearfar.photometry.drift import SAMPLED_PIXELS, Drift, find_references, follow_drift
from nearfar.photometry.in_memory import PhotosInMemory
from nearfar.photometry.noise import NoiseModel, fit_noise, mean_of_few
from nearfar.photometry.photos import (
    PHOTOS_AT_ONCE,
    Photos,
    PhotosWithNoise,
    Wave,
    find_waves,
    in_batches,
)

# Values among which the smallest difference of two levels is searched.
SAMPLED_VALUES = 2**18


@dataclass(frozen=True, eq=False)
class PhotosWithoutDrift(PhotosWithNoise):
    """Photos by reference without the drift of lamp and ambient light.

    Attributes
    ----------
    drift : Drift
    """

    drift: Drift

    @property
    def unsaturated(self) -> Booleans:
        """Where no photo of white is saturated, (Cy, Cx, channels)."""
        return self.drift.unsaturated

    def read(self, indices: Sequence[int], rows: slice) -> Floats:
        """Photos `indices` as float32, (n, len(rows), Cx, channels), without drift."""
        return self.drift.remove_from(self.photos.read(indices, rows), indices, rows)

    def only(self, numbers: Integers) -> "PhotosWithoutDrift":
        """Return some of the photos, in order, in memory.

        The drift is removed as from all, so every photo of white and black must be among them. The
        noise is fitted to the scatter of these photos alone.
        """
        patterns = tuple(self.plan.patterns[number] for number in numbers)
        plan = self.plan.model_copy(update={"patterns": patterns})
        read = self.read(numbers.tolist(), slice(0, self.camera.height))
        drift = self.drift.with_nothing_left(find_references(plan))
        some = PhotosWithoutDrift(PhotosInMemory(plan, read, 1.0), (), drift)
        return replace(some, noise=_noise_of_repeated_patterns(some, self.photos))


def remove_drift(
    photos: Photos, progress: Callable[[int], None] | None = None
) -> PhotosWithoutDrift:
    """Estimate the drift and the noise of a capture, from the whole camera at once.

    Parameters
    ----------
    photos : Photos
        A capture of a plan with offset reference.
    progress : callable, optional
        Called with the number of photos read so far.

    Returns
    -------
    PhotosWithoutDrift
        May be measured in tiles of any rows.

    Raises
    ------
    InputError
        If the plan has fewer than two whites or two blacks, or the lamp failed.
    """
    drift = follow_drift(photos, progress)
    found = PhotosWithoutDrift(photos, (), drift)
    return replace(found, noise=_noise_of_repeated_patterns(found, photos))


def _noise_of_repeated_patterns(
    photos: PhotosWithoutDrift, as_taken: Photos
) -> tuple[NoiseModel, ...]:
    """Fit shot and read noise to the scatter of every pattern that was projected repeatedly.

    The levels of the camera are those of photos as they were taken.
    """
    repeated: dict[tuple[Wave, bool], list[int]] = {}
    for wave, signed in find_waves(photos.plan).items():
        for number, sign in signed:
            repeated.setdefault((wave, sign > 0), []).append(number)
    rows = slice(0, photos.camera.height)
    sampled = slice(None, None, -(-photos.camera.pixels // SAMPLED_PIXELS))
    usable = photos.drift.unsaturated.reshape(-1, photos.channels)[sampled]
    means, variances = [], []
    for numbers in repeated.values():
        if len(numbers) > 1:
            first = photos.read(numbers[:1], rows).reshape(-1, photos.channels)[sampled]
            total, squares = np.zeros(first.shape), np.zeros(first.shape)
            for _, read in in_batches(photos, numbers, rows):
                # Differences from the first photo are small: their sums lose no digits.
                off = (read[:, sampled] - first).astype(np.float64)
                total += off.sum(axis=0)
                squares += (off**2).sum(axis=0)
            means.append(first + total / len(numbers))
            variances.append((squares - total**2 / len(numbers)) / (len(numbers) - 1))
    mean, variance = np.stack(means), np.maximum(np.stack(variances), 0.0)
    rounding = _rounding_variance(as_taken)
    models = []
    for i in range(photos.channels):
        if not usable[:, i].any():
            raise InputError(
                f"white is at full scale at every camera pixel of channel {i}: expose less and "
                f"shoot again."
            )
        dark = float(np.median(photos.drift.black[..., i]))
        models.append(
            fit_noise(
                mean[:, usable[:, i], i],
                variance[:, usable[:, i], i],
                dark,
                photos=1,
                least=rounding,
                typical=mean_of_few,
            )
        )
    return tuple(models)


def _rounding_variance(photos: Photos) -> float:
    """Variance of rounding to whole levels, a twelfth of their squared distance."""
    numbers = range(min(PHOTOS_AT_ONCE, len(photos.plan.patterns)))
    some = photos.read(numbers, slice(0, photos.camera.height)).ravel()
    levels = np.unique(some[:: -(-some.size // SAMPLED_VALUES)].astype(np.float64))
    return float(np.diff(levels).min()) ** 2 / 12 if len(levels) > 1 else 0.0
