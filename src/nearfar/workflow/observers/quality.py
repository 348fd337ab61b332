"""How well a capture's photos so far relight, estimated while it goes on, and what limits them.

The plan has a few pictures that the estimate does not use. At every later white and black, the
transport of some rows of the camera is estimated from the photos so far and relit under those
pictures. Each picture is photographed twice. The errors against the two photos share the
estimate's own error and have independent noise, so the mean of their product is the mean square
of the estimate's error, without a model of the noise.

Index convention: photos are (n, rows, Cx, channels), the chosen rows of the camera only.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Integers, blocks
from nearfar.capture import Decision
from nearfar.correspondence import correspond_by_phase
from nearfar.errors import InputError
from nearfar.estimate.joint import ErrorBars, estimate_jointly
from nearfar.photometry.drift_removal import remove_drift
from nearfar.photometry.in_memory import PhotosInMemory
from nearfar.photometry.measure import measure
from nearfar.photometry.measurements import Measurements
from nearfar.plan import Plan
from nearfar.plan.checks import check_photos, ends
from nearfar.transport.model import Transport
from nearfar.workflow.evaluate import HIGHEST, decibels

# The chosen rows of the camera come in bands of this many, because the estimate of a camera pixel
# uses its neighbours.
ROWS_PER_BAND = 8
# Camera pixels in the chosen rows, about.
CAMERA_PIXELS = 6144
# Sweeps of the joint estimate: one fewer than usual, for time.
SWEEPS = 2
# Photos before the first estimate, besides those of the pictures.
MINIMUM_PHOTOS = 20
# Twice as many photos gain at most this many dB. The next estimate waits for the number of photos
# that this rate needs to reach the target.
MAXIMUM_GAIN_DECIBELS = 8.0
# A target farther away than this counts as this far: the next estimate comes at twice the photos.
MAXIMUM_MISSING_DECIBELS = 8.0
# Where the power of the error exceeds this many times what the error bars expect, the model does
# not fit the scene.
MODEL_ERROR_RATIO = 2.0
# Noise is scaled by this to find the error that photos without noise would leave: that of
# frequencies that were not measured.
NOISE_FACTOR = 1e-3

Limit = Literal["noise", "model", "photos"]


class CaptureQuality(NamedTuple):
    """How well the transport of a capture would relight if it ended now.

    Attributes
    ----------
    photos : int
        Photos taken so far.
    snr : float
        SNR_b in dB, the mean over the pictures to check by.
    limit : {"noise", "model", "photos"}
        Where most of the error comes from: the noise of the photos, light that the model cannot
        represent, or frequencies that were not measured yet.
    fault : str or None
        Why nothing could be estimated from the photos so far, a sentence.
    """

    photos: int
    snr: float
    limit: Limit
    fault: str | None = None


class QualityObserver:
    """Estimates the quality of a capture while it goes on, and ends it once the target is reached.

    Parameters
    ----------
    plan : Plan
        With pictures to check by; see `nearfar.plan.checks.with_checks`.
    target : float
        SNR_b in dB at which the capture ends.
    full_scale : float
        Value of full scale of the photos.
    on_quality : callable, optional
        Called with each `CaptureQuality`.

    Attributes
    ----------
    quality : CaptureQuality or None
        The last estimate; None before the first.
    """

    def __init__(
        self,
        plan: Plan,
        target: float,
        full_scale: float,
        on_quality: Callable[[CaptureQuality], None] | None = None,
    ) -> None:
        self.quality: CaptureQuality | None = None
        self._plan, self._target, self._full_scale = plan, target, full_scale
        self._on_quality = on_quality
        self._photos: list[NDArray[Any]] = []
        self._rows: Integers = np.zeros(0, dtype=np.int64)
        self._ends = set(ends(plan))
        self._next_estimate = MINIMUM_PHOTOS + sum(map(len, check_photos(plan).values()))

    def after_photo(self, number: int, photo: NDArray[Any]) -> Decision:
        """Keep the chosen rows of a photo, (Cy, Cx, channels), and estimate if it is time.

        Raises
        ------
        InputError
            If the first estimate fails. Later failures become `CaptureQuality.fault`, because
            raising them would end the capture.
        """
        if not self._photos:
            self._rows = choose_rows(*photo.shape[:2])
        self._photos.append(photo[self._rows].copy())
        taken = number + 1
        last = taken == len(self._plan.patterns)
        if taken not in self._ends or (taken < self._next_estimate and not last):
            return Decision.CONTINUE
        try:
            self.quality = self._estimate(taken)
        except InputError as error:
            if self.quality is None:
                raise
            self.quality = CaptureQuality(taken, -HIGHEST, "photos", str(error))
        if self._on_quality is not None:
            self._on_quality(self.quality)
        missing = self._target - self.quality.snr
        self._next_estimate = int(
            taken * 2 ** (np.clip(missing, 0.0, MAXIMUM_MISSING_DECIBELS) / MAXIMUM_GAIN_DECIBELS)
        )
        return Decision.ENOUGH if missing <= 0 else Decision.CONTINUE

    def _estimate(self, taken: int) -> CaptureQuality:
        plan = self._plan.first(taken)
        photos_so_far = PhotosInMemory(plan, np.stack(self._photos), self._full_scale)
        photos = remove_drift(photos_so_far)
        measurements = measure(photos)
        try:
            q = correspond_by_phase(measurements).q
        except InputError:
            # Too few frequencies to determine q yet.
            return CaptureQuality(taken, -HIGHEST, "photos")
        estimate = estimate_jointly(measurements, q, plan.window, plan.far, sweeps=SWEEPS)
        every = slice(0, photos_so_far.camera.height)
        values, errors, expected, unmeasured = [], [], 0.0, 0.0
        bars, noiseless_bars = ErrorBars(estimate), ErrorBars(_without_noise(estimate))
        for numbers in check_photos(plan).values():
            light = plan.draw(numbers[0]) / np.float32(255)
            relit = (estimate @ light).reshape(*photos_so_far.camera, -1)
            photographed = photos.read(numbers, every) - _black(measurements)
            signal, error = (_mean_product(part) for part in (photographed, photographed - relit))
            values.append(decibels(signal, max(error, 0.0)))
            errors.append(error)
            expected += float(np.mean(bars.picture(light).astype(np.float64) ** 2))
            unmeasured += float(np.mean(noiseless_bars.picture(light).astype(np.float64) ** 2))
        limit: Limit = "photos" if unmeasured > expected / 2 else "noise"
        if sum(errors) > MODEL_ERROR_RATIO * expected:
            limit = "model"
        return CaptureQuality(taken, float(np.mean(values)), limit)


def choose_rows(height: int, width: int) -> Integers:
    """Choose rows of a camera in bands, spread evenly, about `CAMERA_PIXELS` in all."""
    wanted = min(height, max(ROWS_PER_BAND, CAMERA_PIXELS // width))
    bands = max(1, wanted // ROWS_PER_BAND)
    if wanted == height:
        return np.arange(height)
    starts = [block.start for block in blocks(height, max(1, height // bands))][:bands]
    rows = [np.arange(start, min(start + ROWS_PER_BAND, height)) for start in starts]
    return np.concatenate(rows)


def _black(measurements: Measurements) -> Floats:
    return measurements.black.reshape(*measurements.camera, measurements.channels)


def _mean_product(photos: Floats) -> float:
    """Return the mean product of different photos of one picture, to which noise adds nothing.

    Parameters
    ----------
    photos : ndarray, shape (n, rows, Cx, channels)
    """
    flat = photos.reshape(len(photos), -1).astype(np.float64)
    count = len(flat)
    products = np.sum(flat.sum(axis=0) ** 2) - np.sum(flat**2)
    return float(products / (count * (count - 1) * flat.shape[1]))


def _without_noise(estimate: Transport) -> Transport:
    """Return the estimate with the posterior of photos that have hardly any noise."""
    posterior = estimate.posterior
    assert posterior is not None
    return replace(
        estimate,
        noise=NOISE_FACTOR * estimate.noise,
        posterior=replace(
            posterior,
            offset_noise=NOISE_FACTOR * posterior.offset_noise,
            light_noise=NOISE_FACTOR * posterior.light_noise,
        ),
    )
