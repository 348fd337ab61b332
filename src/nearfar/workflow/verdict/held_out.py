"""Held-out SNR_b: a transport's relit pictures beside photos that its estimate never saw."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, Size, blocks
from nearfar.capture import Capture
from nearfar.estimate.joint import ErrorBars
from nearfar.photometry.drift import find_references
from nearfar.photometry.drift_removal import PhotosWithoutDrift
from nearfar.plan.checks import CheckLight, check_lights
from nearfar.plan.patterns import HalfScreen
from nearfar.progress import Report, ignore_progress
from nearfar.transport.model import Transport
from nearfar.transport.store import StoredTransport
from nearfar.workflow.evaluate import decibels
from nearfar.workflow.reconstruction.sources import photos_without_drift
from nearfar.workflow.verdict.check_pairs import CheckPair, compare_pair, over_both
from nearfar.workflow.verdict.weighed_photos import WeighedPhotos

# What check photos are of, in a word.
PICTURES = "pictures"
# Camera pixels that are compared, about, in bands of this many rows.
CAMERA_PIXELS = 2**17
ROWS_PER_BAND = 8
PIXELS_PER_TALLER_BAND = 2**14
# An error below as many standard deviations of what noise makes of it is hidden by the noise.
HIDDEN_DEVIATIONS = 3.0
# Noise is scaled by this to find the error that photos without noise would leave.
NOISE_FACTOR = 1e-3


@dataclass(frozen=True)
class HeldOutLight:
    """How well a transport relights under one check pattern.

    Attributes
    ----------
    description : str
        The pattern.
    is_binary : bool
        Whether it is white and black alone, whose photos do not tell whether the rig is linear.
    pair : CheckPair or WeighedPhotos
        What its photo and its inverse's say; or the photos for correspondence that show it.
    expected_error : float or None
        Mean square of the error that the error bars expect; None without error bars.
    unmeasured_error : float or None
        The part of it that photos without noise would leave: that of what was not measured.
    """

    description: str
    is_binary: bool
    pair: CheckPair | WeighedPhotos
    expected_error: float | None
    unmeasured_error: float | None

    @property
    def snr(self) -> float:
        """Held-out SNR_b, dB; no better than the noise of the photos can tell."""
        pair = self.pair
        return decibels(pair.signal, max(pair.error, pair.error_deviation))

    @property
    def is_hidden(self) -> bool:
        """Whether noise hides the error, so that it may be smaller than `snr` says."""
        return self.pair.error < HIDDEN_DEVIATIONS * self.pair.error_deviation

    @property
    def photo_snr(self) -> float:
        """One photo, or the weighted sum of photos that shows the light, over its noise, dB."""
        return decibels(self.pair.signal, self.pair.photo_noise)

    @property
    def expected_snr(self) -> float | None:
        """SNR_b that the error bars expect, dB; None without error bars."""
        if self.expected_error is None:
            return None
        return decibels(self.pair.signal, self.expected_error)


@dataclass(frozen=True)
class HeldOut:
    """How well a transport relights under all check patterns of its capture.

    Attributes
    ----------
    lights : tuple of HeldOutLight
        At least one.
    fine : tuple of HeldOutLight
        Lights of high frequencies, such as single rows, which count apart.
    called : str
        What the lights are, in words.
    """

    lights: tuple[HeldOutLight, ...]
    fine: tuple[HeldOutLight, ...] = ()
    called: str = PICTURES

    @property
    def snr(self) -> float:
        """Held-out SNR_b, dB: the mean over the check patterns.

        Where noise hides the error of a pattern, that of all patterns of its kind over what the
        error bars expect stands for its own. Pictures and half-screens weigh frequencies
        differently.
        """
        values = []
        for light in self.lights:
            kind = tuple(each for each in self.lights if each.is_binary == light.is_binary)
            ratio = HeldOut(kind).error_ratio
            if light.is_hidden and ratio is not None and light.expected_snr is not None:
                values.append(light.expected_snr - decibels(ratio, 1.0))
            else:
                values.append(light.snr)
        return float(np.mean(values))

    @property
    def is_least(self) -> bool:
        """Whether `snr` may be higher: noise hides all errors, and no error bars tell them."""
        return self.expected_snr is None and all(light.is_hidden for light in self.lights)

    @property
    def lamp_excess(self) -> float:
        """What half-screens and their inverses show beyond white, as a share of white; or 0."""
        return _mean(light.pair.excess_share for light in self.lights if light.is_binary)

    @property
    def nonlinear_excess(self) -> float:
        """What pictures and their inverses show beyond that, as a share of white.

        A response that bends downwards shows less of both than of white.
        """
        pictures = [light.pair.excess_share for light in self.lights if not light.is_binary]
        return _mean(pictures) - self.lamp_excess if pictures else 0.0

    @property
    def unmeasured_share(self) -> float | None:
        """Share of the expected error that comes from what was not measured, not from noise."""
        unmeasured = expected = 0.0
        for light in self.lights:
            if light.expected_error is None or light.unmeasured_error is None:
                return None
            unmeasured += light.unmeasured_error
            expected += light.expected_error
        return unmeasured / max(expected, 1e-300)

    @property
    def error_ratio(self) -> float | None:
        """Power of the errors over that which the error bars expect; None without error bars."""
        measured = expected = variance = 0.0
        for light in self.lights:
            if light.expected_error is None:
                return None
            signal = max(light.pair.signal, 1e-300)
            measured += light.pair.error / signal
            expected += light.expected_error / signal
            variance += (light.pair.error_deviation / signal) ** 2
        return float(max(measured, np.sqrt(variance)) / max(expected, 1e-300))

    @property
    def expected_snr(self) -> float | None:
        """SNR_b that the error bars expect, dB: the mean; None without error bars."""
        values = [light.expected_snr for light in self.lights if light.expected_snr is not None]
        return float(np.mean(values)) if values else None


def _mean(values: Iterable[float]) -> float:
    listed = list(values)
    return float(np.mean(listed)) if listed else 0.0


class Bars(NamedTuple):
    """Error bars of a transport, and those of the same photos with hardly any noise."""

    of_all: ErrorBars
    of_unmeasured: ErrorBars


def bars_of(transport: Transport) -> Bars | None:
    """Return the error bars of a transport; None if it was not estimated jointly.

    A verdict that it has already does not widen them.
    """
    posterior = transport.posterior
    if posterior is None:
        return None
    transport = replace(transport, verdict=None)
    without_noise = replace(
        transport,
        noise=NOISE_FACTOR * transport.noise,
        posterior=replace(
            posterior,
            offset_noise=NOISE_FACTOR * posterior.offset_noise,
            light_noise=NOISE_FACTOR * posterior.light_noise,
        ),
    )
    return Bars(ErrorBars(transport), ErrorBars(without_noise))


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
    lights = [light for light in check_lights(capture.plan) if light.photos and light.inverses]
    if not lights:
        return None
    photos = photos_without_drift(capture, progress)
    if not isinstance(photos, PhotosWithoutDrift):
        return None
    found: list[HeldOutLight | None] = [None] * len(lights)
    for rows in bands(transport.camera):
        block = transport.rows(rows)
        if block.quality is not None and block.quality.saturated.all():
            continue
        bars = bars_of(block)
        for number, light in enumerate(lights):
            found[number] = joined(found[number], compare_light(block, bars, photos, light, rows))
        progress("check photos", rows.stop / transport.camera.height)
    compared = tuple(light for light in found if light is not None)
    return HeldOut(compared) if compared else None


def bands(camera: Size) -> list[slice]:
    """Return bands of rows of a camera, spread evenly, about `CAMERA_PIXELS` in all."""
    every = list(blocks(camera.height, ROWS_PER_BAND))
    step = max(1, round(camera.pixels / CAMERA_PIXELS))
    return every[step // 2 :: step] or every[:1]


def taller_bands(camera: Size) -> list[slice]:
    """Return the rows of `bands` in fewer bands, where they are all rows of the camera.

    For what is done to each camera pixel by itself. A photo of a small camera is one chunk, which
    every band reads again.
    """
    found = bands(camera)
    if sum(rows.stop - rows.start for rows in found) < camera.height:
        return found
    return list(blocks(camera.height, max(ROWS_PER_BAND, PIXELS_PER_TALLER_BAND // camera.width)))


def compare_light(
    block: Transport,
    bars: Bars | None,
    photos: PhotosWithoutDrift,
    light: CheckLight,
    rows: slice,
) -> HeldOutLight:
    """Compare the camera pixels of a block of rows that are not saturated.

    Parameters
    ----------
    block : Transport
        Of these rows.
    bars : Bars, optional
        Of the block.
    photos : PhotosWithoutDrift
    light : CheckLight
        Of the plan of the photos; with its inverse.
    rows : slice
    """
    size = (block.camera.pixels, block.channels)
    usable = np.ones(block.camera.pixels, dtype=bool)
    if block.quality is not None:
        usable &= ~block.quality.saturated.ravel()
    pattern = light.pattern.draw(block.projector) / np.float32(255)
    relit, white = (
        np.asarray(block @ shown).reshape(size)[usable]
        for shown in (pattern, np.ones_like(pattern))
    )
    black = block.black.reshape(size)[usable]
    means = [
        photos.read(numbers, rows).reshape(len(numbers), *size).mean(axis=0)[usable]
        for numbers in (light.photos, light.inverses)
    ]
    whites, blacks = find_references(photos.plan)
    of_white = _noise(photos, white + black, whites) + _noise(photos, black, blacks)
    expected = unmeasured = None
    share_of_pattern = 1.0
    if bars is not None:
        of_white = mean_square(bars.of_all, np.ones_like(pattern), usable)
        expected, unmeasured = (mean_square(each, pattern, usable) for each in bars)
        of_inverse = mean_square(bars.of_all, 1 - pattern, usable)
        share_of_pattern = 2 * expected / max(expected + of_inverse, 1e-300)
    pair = compare_pair(
        means[0] - black,
        means[1] - black,
        relit,
        white=white,
        noise=(_noise(photos, means[0], light.photos) + _noise(photos, means[1], light.inverses))
        / 2,
        error_of_white=of_white,
        share_of_pattern=share_of_pattern,
    )
    is_binary = isinstance(light.pattern, HalfScreen)
    return HeldOutLight(light.pattern.description, is_binary, pair, expected, unmeasured)


def mean_square(bars: ErrorBars, light: Floats, usable: Booleans) -> float:
    """Return the expected square of the error under a light, mean over usable camera pixels.

    Parameters
    ----------
    bars : ErrorBars
    light : ndarray, shape (Py, Px)
    usable : ndarray of bool, shape (C,)
    """
    deviation = bars.picture(light).reshape(len(usable), -1)[usable]
    return float(np.mean(np.square(deviation, dtype=np.float64)))


def _noise(photos: PhotosWithoutDrift, mean: Floats, numbers: Sequence[int] | Integers) -> float:
    """Return the mean variance of the mean of some photos of a pattern."""
    return float(photos.variance(mean).mean()) / len(numbers)


def joined(one: HeldOutLight | None, other: HeldOutLight) -> HeldOutLight:
    """Return the comparison under one light over the camera pixels of both."""
    if one is None or not one.pair.values:
        return other
    if not other.pair.values:
        return one
    counts = (one.pair.values, other.pair.values)

    def mean(first: float | None, second: float | None) -> float | None:
        if first is None or second is None:
            return None
        return float(np.average((first, second), weights=counts))

    return HeldOutLight(
        one.description,
        one.is_binary,
        over_both(one.pair, other.pair),
        mean(one.expected_error, other.expected_error),
        mean(one.unmeasured_error, other.unmeasured_error),
    )
