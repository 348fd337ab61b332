"""Held-out SNR_b: a transport's relit pictures beside photos that its estimate never saw."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from nearfar.workflow.evaluate import decibels
from nearfar.workflow.verdict.check_pairs import CheckPair, over_both
from nearfar.workflow.verdict.weighed_photos import WeighedPhotos

# What check photos are of, in a word.
PICTURES = "pictures"
# An error below as many standard deviations of what noise makes of it is hidden by the noise.
HIDDEN_DEVIATIONS = 3.0


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
        Comparison with the photos of the pattern and its inverse, or with the photos for
        correspondence that show the light.
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

    @property
    def noise_snr(self) -> float | None:
        """SNR_b that the noise of the photos alone allows, dB; None without error bars."""
        if self.expected_error is None or self.unmeasured_error is None:
            return None
        return decibels(self.pair.signal, max(self.expected_error - self.unmeasured_error, 0.0))


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

        Where noise hides the error of a pattern, its expected SNR_b is taken, corrected by the
        error ratio of all patterns of its kind (pictures or half-screens, which weigh frequencies
        differently).
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
        """Whether the true SNR_b may be higher: noise hides all errors, without error bars."""
        return self.expected_snr is None and all(light.is_hidden for light in self.lights)

    @property
    def lamp_excess(self) -> float:
        """Mean `excess_share` of the half-screens; 0 without any."""
        return _mean(light.pair.excess_share for light in self.lights if light.is_binary)

    @property
    def nonlinear_excess(self) -> float:
        """Mean `excess_share` of the pictures less that of the half-screens; 0 without pictures.

        A response that bends downwards makes it negative.
        """
        pictures = [light.pair.excess_share for light in self.lights if not light.is_binary]
        return _mean(pictures) - self.lamp_excess if pictures else 0.0

    @property
    def lamp_excess_deviation(self) -> float:
        """Standard deviation of `lamp_excess`, from the noise of the photos."""
        return _deviation_of_mean(
            light.pair.excess_deviation for light in self.lights if light.is_binary
        )

    @property
    def nonlinear_excess_deviation(self) -> float:
        """Standard deviation of `nonlinear_excess`, from the noise of the photos."""
        pictures = [light.pair.excess_deviation for light in self.lights if not light.is_binary]
        return float(np.hypot(_deviation_of_mean(pictures), self.lamp_excess_deviation))

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
        relative = self._relative_errors()
        if relative is None:
            return None
        measured, deviation, expected = relative
        return float(max(measured, deviation) / expected)

    @property
    def error_ratio_deviation(self) -> float | None:
        """Standard deviation of `error_ratio`, from the noise of the photos."""
        relative = self._relative_errors()
        return None if relative is None else relative[1] / relative[2]

    def _relative_errors(self) -> tuple[float, float, float] | None:
        """Return the errors' power over the lights', its deviation, and what is expected, summed.

        None without error bars.
        """
        measured = expected = variance = 0.0
        for light in self.lights:
            if light.expected_error is None:
                return None
            signal = max(light.pair.signal, 1e-300)
            measured += light.pair.error / signal
            expected += light.expected_error / signal
            variance += (light.pair.error_deviation / signal) ** 2
        return measured, float(np.sqrt(variance)), max(expected, 1e-300)

    @property
    def expected_snr(self) -> float | None:
        """SNR_b that the error bars expect, dB: the mean; None without error bars."""
        return _mean_known(light.expected_snr for light in self.lights)

    @property
    def noise_snr(self) -> float | None:
        """SNR_b that the noise of the photos alone allows, dB: the mean; None as `expected_snr`."""
        return _mean_known(light.noise_snr for light in self.lights)


def _mean(values: Iterable[float]) -> float:
    listed = list(values)
    return float(np.mean(listed)) if listed else 0.0


def _deviation_of_mean(deviations: Iterable[float]) -> float:
    """Return the standard deviation of the mean of independent values; 0 without any."""
    listed = list(deviations)
    return float(np.linalg.norm(listed)) / len(listed) if listed else 0.0


def _mean_known(values: Iterable[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None


def joined(one: HeldOutLight, other: HeldOutLight) -> HeldOutLight:
    """Return the comparison under one light over the camera pixels of both."""
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
