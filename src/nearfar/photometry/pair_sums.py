"""Sums of inverse pairs: all are white + black, so that they show noise and drift of the light.

Index convention: arrays are (C, channels) with C camera pixels row by row.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats
from nearfar.illumination.frequencies import DC
from nearfar.photometry.by_inverse import Pair, find_pairs
from nearfar.photometry.noise import fit_noise, variance_by_channel
from nearfar.photometry.photos import Photos, PhotosWithNoise, in_batches


@dataclass(frozen=True, eq=False)
class PhotosOfPairs(PhotosWithNoise):
    """Photos of inverse pairs with a model of their noise.

    Attributes
    ----------
    light : ndarray, shape (pairs,)
        Sum of each pair, mean over the camera, as a share of the mean over all pairs.
    scatter : float
        Variance of the sums over that which the noise model expects.
    """

    light: Floats
    scatter: float


def sum_pairs(
    photos: Photos, bands: Sequence[slice], progress: Callable[[float], None] | None = None
) -> PhotosOfPairs:
    """Estimate noise and drift of a capture of inverse pairs from the sums of the pairs.

    Camera pixels that are saturated under white are left out.

    Parameters
    ----------
    photos : Photos
        A capture of a plan with offset inverse.
    bands : sequence of slice
        Rows of the camera that are measured; they may have steps.
    progress : callable, optional
        Called with the share that is done.

    Raises
    ------
    InputError
        If a pattern has no inverse.
    """
    pairs = find_pairs(photos.plan)
    report = progress or (lambda _share: None)
    white = [pair.photo for pair in pairs if pair.frequency == DC]
    light = np.zeros(len(pairs))
    usable = []
    for done, rows in enumerate(bands, 1):
        usable.append(below_full_scale(photos, white, rows))
        light += [both[usable[-1]].sum() for both in _sums(photos, pairs, rows)]
        report(done / len(bands) / 2)
    # A pair without any light, such as of a projector that is off, divides nothing.
    light = np.where(light > 0, light / max(float(light.mean()), 1e-300), 1.0)
    black = [pair.inverse for pair in pairs if pair.frequency == DC]
    means, variances, dark = [], [], []
    for done, rows in enumerate(bands, 1):
        mean, variance = _moments(photos, pairs, rows, light)
        means.append(mean)
        variances.append(variance)
        dark += [photos.read([number], rows).reshape(-1, photos.channels) for number in black]
        report((1 + done / len(bands)) / 2)
    mean, variance = np.concatenate(means), np.concatenate(variances)
    known = np.concatenate(usable)
    if not known.any(axis=0).all():
        # Nothing is known of the noise of a channel that is all saturated.
        known = np.ones_like(known)
    levels = np.median(np.concatenate(dark), axis=0) if dark else np.zeros(photos.channels)
    noise = tuple(
        fit_noise(mean[known[:, i], i], variance[known[:, i], i], float(levels[i]))
        for i in range(photos.channels)
    )
    expected = 2 * float(variance_by_channel(noise, mean / 2)[known].mean())
    return PhotosOfPairs(photos, noise, light, float(variance[known].mean()) / expected)


def below_full_scale(photos: Photos, white: Sequence[int], rows: slice) -> Booleans:
    """Return where no photo of white is saturated, (C, channels); everywhere without any."""
    shape = (len(range(*rows.indices(photos.camera.height))) * photos.camera.width, photos.channels)
    return np.asarray((photos.read(white, rows) < 1.0).all(axis=0).reshape(shape))


def _sums(photos: Photos, pairs: Sequence[Pair], rows: slice) -> Iterator[NDArray[np.float64]]:
    """Yield the sum of each pair, (C, channels)."""
    # Batches hold an even number of photos, and so whole pairs.
    numbers = [number for pair in pairs for number in (pair.photo, pair.inverse)]
    for _, read in in_batches(photos, numbers, rows):
        yield from read[::2].astype(np.float64) + read[1::2]


def _moments(
    photos: Photos, pairs: Sequence[Pair], rows: slice, light: Floats
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return mean and variance of the pairs' sums under the mean of the light, (C, channels)."""
    total = squares = first = np.zeros(())
    for number, (both, gain) in enumerate(zip(_sums(photos, pairs, rows), light, strict=True)):
        steady = both / gain
        first = steady if number == 0 else first
        # Differences from the first are small: their sums lose no digits.
        off = steady - first
        total, squares = total + off, squares + off**2
    count = len(pairs)
    variance = np.maximum(squares - total**2 / count, 0.0) / max(count - 1, 1)
    return first + total / count, variance
