"""Photos by reference without the drift of lamp and ambient light, and a model of their noise.

Index convention: arrays are (photos, C, channels) with C camera pixels row by row; i runs over
channels.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers
from nearfar.errors import InputError
from nearfar.photometry.drift import Drift, find_references, follow_drift, sampled_pixels
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
        return replace(some, noise=_noise_of_repeated_patterns(some, self.photos, {}))


def remove_drift(
    photos: Photos, progress: Callable[[int], None] | None = None
) -> PhotosWithoutDrift:
    """Estimate the drift and the noise of a capture, from the whole camera at once.

    Parameters
    ----------
    photos : Photos
        A capture of a plan with offset reference.
    progress : callable, optional
        Called with the number of references read, and then fitted, so far.

    Returns
    -------
    PhotosWithoutDrift
        May be measured in tiles of any rows.

    Raises
    ------
    InputError
        If the plan has fewer than two whites or two blacks, or the lamp failed.
    """
    drift, samples = follow_drift(photos, progress)
    found = PhotosWithoutDrift(photos, (), drift)
    return replace(found, noise=_noise_of_repeated_patterns(found, photos, samples))


def _noise_of_repeated_patterns(
    photos: PhotosWithoutDrift, as_taken: Photos, samples: Mapping[int, Floats]
) -> tuple[NoiseModel, ...]:
    """Fit shot and read noise to the scatter of every pattern that was projected repeatedly.

    The levels of the camera are those of photos as they were taken. Of some photos there are
    samples, and they are not read again.
    """
    repeated: dict[tuple[Wave, bool], list[int]] = {}
    for wave, signed in find_waves(photos.plan).items():
        for number, sign in signed:
            repeated.setdefault((wave, sign > 0), []).append(number)
    drift = photos.drift.of_pixels(sampled_pixels(photos))
    usable = drift.unsaturated[0]
    means, variances = [], []
    for numbers in repeated.values():
        if len(numbers) > 1:
            mean, variance = _mean_and_variance(
                drift.remove_from_sample(taken, number)
                for number, taken in _sampled(photos.photos, numbers, samples)
            )
            means.append(mean)
            variances.append(variance)
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


def _mean_and_variance(values: Iterable[Floats]) -> tuple[Floats, Floats]:
    """Return the mean and the variance of at least two arrays, one after another."""
    rest = iter(values)
    first = next(rest)
    # Differences from the first are small: their sums lose no digits.
    total, squares, count = np.zeros(first.shape), np.zeros(first.shape), 1
    for one in rest:
        off = (one - first).astype(np.float64)
        total += off
        squares += off**2
        count += 1
    return first + total / count, (squares - total**2 / count) / (count - 1)


def _sampled(
    photos: Photos, numbers: Sequence[int], samples: Mapping[int, Floats]
) -> Iterator[tuple[int, Floats]]:
    """Yield photos as they were taken at the sampled camera pixels, (S, channels) each."""
    if all(number in samples for number in numbers):
        yield from ((number, samples[number]) for number in numbers)
        return
    chosen = sampled_pixels(photos)
    for some, read in in_batches(photos, numbers, slice(0, photos.camera.height)):
        yield from zip(some, read[:, chosen], strict=True)


def _rounding_variance(photos: Photos) -> float:
    """Variance of rounding to whole levels, a twelfth of their squared distance."""
    numbers = range(min(PHOTOS_AT_ONCE, len(photos.plan.patterns)))
    step = -(-len(numbers) * photos.camera.pixels * photos.channels // SAMPLED_VALUES)
    some, first = [], 0
    for _, read in in_batches(photos, numbers, slice(0, photos.camera.height)):
        some.append(read.ravel()[-first % step :: step])
        first += read.size
    levels = np.unique(np.concatenate(some).astype(np.float64))
    return float(np.diff(levels).min()) ** 2 / 12 if len(levels) > 1 else 0.0
