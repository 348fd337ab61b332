"""Held-out SNR_b of a capture with check photos."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.capture import Capture
from nearfar.photometry.drift import find_references
from nearfar.photometry.drift_removal import PhotosWithoutDrift
from nearfar.plan import Plan
from nearfar.plan.checks import CheckLight, check_lights
from nearfar.plan.patterns import HalfScreen
from nearfar.progress import Report, ignore_progress
from nearfar.transport.model import Transport
from nearfar.transport.stored import StoredTransport
from nearfar.workflow.reconstruction.sources import photos_without_drift
from nearfar.workflow.verdict.bands import compare_in_bands, of_bands, usable_pixels
from nearfar.workflow.verdict.bars import Bars, mean_squares
from nearfar.workflow.verdict.check_pairs import compare_pair
from nearfar.workflow.verdict.held_out import HeldOut, HeldOutLight


def measure_held_out(
    transport: StoredTransport, capture: Capture, progress: Report = ignore_progress
) -> HeldOut | None:
    """Compare a transport with the check photos of the capture that it was reconstructed from.

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
        None if the plan has no check patterns with their inverses, or every camera pixel is
        saturated.

    Raises
    ------
    UnreadableFileError
        If the transport or the capture is damaged.
    """
    lights = _pairs(capture.plan)
    if not lights:
        return None
    photos = photos_without_drift(capture, progress)
    if not isinstance(photos, PhotosWithoutDrift):
        return None
    compared = compare_in_bands(
        transport,
        lambda block, bars, rows: compare_lights(block, bars, photos, lights, rows),
        lambda share: progress("check photos", share),
    )
    return HeldOut(compared) if compared else None


def _pairs(plan: Plan) -> list[CheckLight]:
    """Return the check patterns of a plan that come with their inverses."""
    return [light for light in check_lights(plan) if light.photos and light.inverses]


def without_photos(held_out: HeldOut, plan: Plan, spoilt: Collection[int]) -> HeldOut | None:
    """Leave out the check patterns some of whose photos are spoilt.

    Parameters
    ----------
    held_out : HeldOut
        As `measure_held_out` returns it.
    plan : Plan
        Of the capture.
    spoilt : collection of int
        Numbers of the photos.

    Returns
    -------
    HeldOut or None
        None if no check pattern is left.
    """
    lights = tuple(
        compared
        for light, compared in zip(_pairs(plan), held_out.lights, strict=True)
        if not any(number in spoilt for number in (*light.photos, *light.inverses))
    )
    return replace(held_out, lights=lights) if lights else None


def compare_lights(
    block: Transport,
    bars: Bars | None,
    photos: PhotosWithoutDrift,
    lights: Sequence[CheckLight],
    rows: Sequence[slice],
) -> list[HeldOutLight]:
    """Compare the camera pixels of some bands of rows that are not saturated.

    Parameters
    ----------
    block : Transport
        Of these bands.
    bars : Bars, optional
        Of the block.
    photos : PhotosWithoutDrift
    lights : sequence of CheckLight
        Of the plan of the photos; with their inverses.
    rows : sequence of slice
        Of each band.
    """
    size = (block.camera.pixels, block.channels)
    usable = usable_pixels(block)
    ones = np.ones(block.projector, dtype=np.float32)
    white = np.asarray(block @ ones).reshape(size)[usable]
    black = block.black.reshape(size)[usable]
    whites, blacks = find_references(photos.plan)
    of_white = _noise(photos, white + black, whites) + _noise(photos, black, blacks)
    drawn = [light.pattern.draw(block.projector) / np.float32(255) for light in lights]
    if bars is not None:
        inverses = [1 - pattern for pattern in drawn]
        of_white, *of_lights = mean_squares(bars.of_all, [ones, *drawn, *inverses], usable)
        of_unmeasured = mean_squares(bars.of_unmeasured, drawn, usable)
    found = []
    for number, (light, pattern) in enumerate(zip(lights, drawn, strict=True)):
        means = [
            of_bands(partial(_read, photos, numbers), rows).mean(axis=0)[usable]
            for numbers in (light.photos, light.inverses)
        ]
        expected = unmeasured = None
        share_of_pattern = 1.0
        if bars is not None:
            expected, unmeasured = of_lights[number], of_unmeasured[number]
            of_inverse = of_lights[len(lights) + number]
            share_of_pattern = 2 * expected / max(expected + of_inverse, 1e-300)
        noise = _noise(photos, means[0], light.photos) + _noise(photos, means[1], light.inverses)
        pair = compare_pair(
            means[0] - black,
            means[1] - black,
            np.asarray(block @ pattern).reshape(size)[usable],
            white=white,
            noise=noise / 2,
            error_of_white=of_white,
            share_of_pattern=share_of_pattern,
        )
        is_binary = isinstance(light.pattern, HalfScreen)
        description = light.pattern.description
        found.append(HeldOutLight(description, is_binary, pair, expected, unmeasured))
    return found


def _read(photos: PhotosWithoutDrift, numbers: Sequence[int], rows: slice) -> Floats:
    """Read some photos of a band, (n, C, channels)."""
    read = photos.read(numbers, rows)
    return read.reshape(len(read), -1, read.shape[-1])


def _noise(photos: PhotosWithoutDrift, mean: Floats, numbers: Sequence[int] | Integers) -> float:
    """Return the mean variance of the mean of some photos of a pattern."""
    return float(photos.variance(mean).mean()) / len(numbers)
