"""Held-out SNR_b of a capture without check photos, by its photos for correspondence."""

from collections.abc import Sequence

import numpy as np

from nearfar.arrays import Booleans, Floats
from nearfar.capture import Capture
from nearfar.photometry.drift import find_references
from nearfar.photometry.photos import PhotosWithNoise, in_batches, mean_photo
from nearfar.progress import Report, ignore_progress
from nearfar.transport.model import Transport
from nearfar.transport.stored import StoredTransport
from nearfar.workflow.verdict.bands import compare_in_bands, of_bands, usable_pixels
from nearfar.workflow.verdict.bars import Bars, expected_and_unmeasured, mean_squares
from nearfar.workflow.verdict.correspondence_lights import WeighedLight, correspondence_lights
from nearfar.workflow.verdict.held_out import HeldOut, HeldOutLight
from nearfar.workflow.verdict.repeats import photos_with_noise
from nearfar.workflow.verdict.weighed_photos import compare_weighed

# What the coarse lights are, in words.
COARSE = "half-screens and wide bars"


def measure_by_correspondence(
    transport: StoredTransport, capture: Capture, progress: Report = ignore_progress
) -> HeldOut | None:
    """Compare a transport with the stripes or the Gray code of its capture.

    Of a large camera, evenly spaced rows are compared.

    Parameters
    ----------
    transport : StoredTransport
        Of the camera's pixels, not a square T.
    capture : Capture
    progress : callable
        Called with the step and the share of it that is done.

    Returns
    -------
    HeldOut or None
        None if the plan has neither, or every camera pixel is saturated.

    Raises
    ------
    UnreadableFileError
        If the transport or the capture is damaged.
    """
    lights = correspondence_lights(capture.plan)
    if all(light.is_fine for light in lights):
        return None
    photos = photos_with_noise(capture, progress)
    compared = compare_in_bands(
        transport,
        lambda block, bars, rows: _compare(block, bars, photos, lights, rows),
        lambda share: progress("photos for correspondence", share),
    )
    if not compared:
        return None
    coarse, fine = (
        tuple(one for light, one in zip(lights, compared, strict=True) if light.is_fine == is_fine)
        for is_fine in (False, True)
    )
    return HeldOut(coarse, fine, COARSE)


def _compare(
    block: Transport,
    bars: Bars | None,
    photos: PhotosWithNoise,
    lights: list[WeighedLight],
    rows: Sequence[slice],
) -> list[HeldOutLight]:
    """Compare the camera pixels of some bands of rows that are not saturated."""
    size = (block.camera.pixels, block.channels)
    usable = usable_pixels(block)
    ones = np.ones(block.projector, dtype=np.float32)
    drawn = [light.light - np.float32(light.level) for light in lights]
    relit = block.pictures(np.stack([ones, *drawn])).reshape(-1, *size)[:, usable]
    white, relit = relit[0], relit[1:]
    black = block.black.reshape(size)[usable]
    of_white = _error_of_white(bars, photos, usable, rows)
    shown, variance = of_bands(lambda one: _weighed(photos, lights, one), rows)
    expected = expected_and_unmeasured(bars, [light.light for light in lights], usable)
    found = []
    for number, light in enumerate(lights):
        both = _mean(photos, light.photos, rows)[usable] if light.has_inverse else None
        weighed = compare_weighed(
            shown[number][usable],
            relit[number],
            level=light.level,
            white=white,
            noise=float(np.mean(variance[number][usable])),
            mean=None if both is None else both - black,
            error_of_white=of_white / 4,
        )
        # Bars and their inverses sum to white unless the camera's response bends; or the lamp
        # drifts, which nothing removes from inverse pairs.
        is_binary = photos.plan.offset != "reference"
        found.append(HeldOutLight(light.description, is_binary, weighed, *expected[number]))
    return found


def _mean(photos: PhotosWithNoise, numbers: Sequence[int], rows: Sequence[slice]) -> Floats:
    """Return the mean of photos in some bands, (C, channels)."""
    return of_bands(lambda one: mean_photo(photos, numbers, one), rows)


def _weighed(photos: PhotosWithNoise, lights: list[WeighedLight], rows: slice) -> Floats:
    """Return the weighted sum of the photos of each light, and its variance.

    Shape (2, L, C, channels).
    """
    numbers = sorted({number for light in lights for number in light.photos})
    place = {number: i for i, number in enumerate(numbers)}
    weights = np.zeros((len(lights), len(numbers)))
    for light, of_light in zip(lights, weights, strict=True):
        of_light[[place[number] for number in light.photos]] = light.weights
    shown = variance = np.zeros(())
    for batch, read in in_batches(photos, numbers, rows):
        mine = weights[:, [place[number] for number in batch]]
        variances = np.stack([photos.variance(photo) for photo in read])
        shown = shown + np.tensordot(mine, read, axes=1)
        variance = variance + np.tensordot(mine**2, variances, axes=1)
    return np.stack([shown, variance])


def _error_of_white(
    bars: Bars | None, photos: PhotosWithNoise, usable: Booleans, rows: Sequence[slice]
) -> float:
    """Return the mean square that the error of the picture under white is expected to have."""
    if bars is not None:
        white = np.ones(photos.plan.projector, dtype=np.float32)
        return mean_squares(bars.of_all, [white], usable)[0]
    if photos.plan.offset != "reference":
        # All pairs measure white, so that it has hardly any error.
        return 0.0
    return sum(
        float(photos.variance(_mean(photos, numbers.tolist(), rows))[usable].mean()) / len(numbers)
        for numbers in find_references(photos.plan)
    )
