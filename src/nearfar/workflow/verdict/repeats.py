"""Noise, drift and linearity of a capture without check photos, by photos of the same light.

A plan by reference shows white and black again and again. Every inverse pair sums to white and
black where the response is linear.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from nearfar.capture import Capture
from nearfar.photometry.by_inverse import find_pairs
from nearfar.photometry.drift_removal import PhotosWithoutDrift
from nearfar.photometry.pair_sums import PhotosOfPairs, below_full_scale, sum_pairs
from nearfar.photometry.photos import mean_photo
from nearfar.plan import Plan, Sinusoid
from nearfar.plan.checks import is_reference
from nearfar.progress import Report, ignore_progress
from nearfar.workflow.evaluate import decibels
from nearfar.workflow.reconstruction.sources import photos_without_drift
from nearfar.workflow.verdict.bands import sampled_rows


@dataclass(frozen=True)
class Repeats:
    """Noise, drift and linearity of a capture.

    Attributes
    ----------
    white_snr : float
        One photo of white over its noise, dB.
    scatter : float
        Variance of photos of the same light, over the variance that the model of shot and read
        noise expects.
    lamp, ambient : float
        Largest less smallest lamp, and ambient light, as shares of white. Inverse pairs do not tell
        them apart: `lamp` is both together, and None if only one pair shows it.
    excess : float or None
        Sum of inverse pairs less white and black, as a share of white; None without pairs.
    """

    white_snr: float
    scatter: float
    lamp: float | None
    ambient: float
    excess: float | None

    def __str__(self) -> str:
        said = (
            f"one photo of white is {self.white_snr:.1f} dB over its noise; what was shown again "
            f"scatters {self.scatter:.2g} times as much as shot and read noise do"
        )
        if self.excess is None:
            return (
                f"{said}; the lamp changed by {self.lamp:.2%}, ambient light by {self.ambient:.2%} "
                f"of white."
            )
        if self.lamp is not None:
            said += f"; the light changed by {self.lamp:.2%}"
        return (
            f"{said}; what pairs sum to differs from white "
            f"and black by {self.excess:+.2%} of white, by nothing if the response is linear."
        )


def measure_repeats(
    capture: Capture, provenance: Mapping[str, Any], progress: Report = ignore_progress
) -> Repeats:
    """Measure noise, drift and linearity of a capture by photos of the same light.

    Of a large camera, evenly spaced rows are measured. Camera pixels that are saturated under white
    are left out.

    Parameters
    ----------
    capture : Capture
    provenance : mapping
        Of the transport that was reconstructed from it.
    progress : callable
        Called with the step and the share of it that is done.

    Raises
    ------
    UnreadableFileError
        If the capture is damaged.
    """
    photos = photos_with_noise(capture, progress)
    shown = [_numbers(capture.plan, inverse=inverse) for inverse in (False, True)]
    signal = noise = scattered = expected = 0.0
    for rows in sampled_rows(photos.camera):
        white, black = (mean_photo(photos, numbers, rows) for numbers in shown)
        usable = below_full_scale(photos, shown[0], rows)
        signal += float(np.sum((white - black)[usable] ** 2))
        noise += float(np.sum(photos.variance(white)[usable]))
        for numbers, mean in zip(shown, (white, black), strict=True):
            for number in numbers if len(numbers) > 1 else []:
                photo = photos.read([number], rows).reshape(mean.shape)
                scattered += (
                    float(np.sum((photo - mean)[usable] ** 2)) * len(numbers) / (len(numbers) - 1)
                )
                expected += float(np.sum(photos.variance(mean)[usable]))
    white_snr = decibels(signal, noise)
    if isinstance(photos, PhotosOfPairs):
        # White and the checkerboard sum to more than others where the response bends.
        lights = [
            light
            for pair, light in zip(find_pairs(photos.plan), photos.light, strict=True)
            if not pair.frequency.is_own_negative
        ]
        lamp = float(np.ptp(lights)) if len(lights) > 1 else None
        return Repeats(white_snr, photos.scatter, lamp, 0.0, float(provenance["excess_of_sums"]))
    drift = photos.drift
    return Repeats(
        white_snr, scattered / max(expected, 1e-300), drift.lamp_range, drift.ambient_range, None
    )


def photos_with_noise(
    capture: Capture, progress: Report = ignore_progress
) -> PhotosWithoutDrift | PhotosOfPairs:
    """Return the photos of a capture with a model of their noise, by reference without drift."""
    photos = photos_without_drift(capture, progress)
    if isinstance(photos, PhotosWithoutDrift):
        return photos
    return sum_pairs(
        photos, sampled_rows(capture.camera), lambda share: progress("inverse pairs", share)
    )


def _numbers(plan: Plan, *, inverse: bool) -> list[int]:
    """Return the numbers of the photos of white, or of black."""
    return [
        number
        for number, pattern in enumerate(plan.patterns)
        if is_reference(pattern) and isinstance(pattern, Sinusoid) and pattern.inverse == inverse
    ]
