"""How well a capture's photos so far relight, estimated while it goes on, and what limits them.

The plan has a few pictures that the estimate does not use. At every later white and black, the
transport of some rows of the camera is estimated from the photos so far and relit under those
pictures; see `nearfar.workflow.verdict.check_pairs`.

Index convention: photos are (n, rows, Cx, channels), the chosen rows of the camera only.
"""

from collections.abc import Callable
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Integers, blocks
from nearfar.capture import Decision
from nearfar.correspondence import correspond_by_phase
from nearfar.errors import InputError
from nearfar.estimate.joint import estimate_jointly
from nearfar.photometry.drift_removal import remove_drift
from nearfar.photometry.in_memory import PhotosInMemory
from nearfar.photometry.measure import measure
from nearfar.plan import Plan
from nearfar.plan.checks import check_lights, ends
from nearfar.workflow.evaluate import HIGHEST
from nearfar.workflow.verdict.bars import bars_of
from nearfar.workflow.verdict.by_check_photos import compare_lights
from nearfar.workflow.verdict.held_out import HeldOut

# The chosen rows of the camera come in bands of this many, because the estimate of a camera pixel
# uses its neighbours.
ROWS_PER_BAND = 8
# Camera pixels in the chosen rows, about.
CAMERA_PIXELS = 6144
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
    expected_snr, noise_snr : float or None
        SNR_b that the error bars expect, and that the noise of the photos so far alone allows, dB;
        None where nothing could be estimated.
    """

    photos: int
    snr: float
    limit: Limit
    fault: str | None = None
    expected_snr: float | None = None
    noise_snr: float | None = None


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
        self._next_estimate = MINIMUM_PHOTOS + plan.counts["check"]

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
            q = correspond_by_phase(measurements, pitch=plan.pitch).q
        except InputError:
            # Too few frequencies to determine q yet.
            return CaptureQuality(taken, -HIGHEST, "photos")
        estimate = estimate_jointly(measurements, q, plan.window, plan.far, pitch=plan.pitch)
        every = slice(0, photos_so_far.camera.height)
        bars = bars_of(estimate)
        compared = compare_lights(estimate, bars, photos, check_lights(plan), [every])
        held_out = HeldOut(tuple(compared))
        limit: Limit = "photos" if (held_out.unmeasured_share or 0.0) > 0.5 else "noise"
        if (held_out.error_ratio or 0.0) > MODEL_ERROR_RATIO:
            limit = "model"
        return CaptureQuality(
            taken,
            held_out.snr,
            limit,
            expected_snr=held_out.expected_snr,
            noise_snr=held_out.noise_snr,
        )


def choose_rows(height: int, width: int) -> Integers:
    """Choose rows of a camera in bands, spread evenly, about `CAMERA_PIXELS` in all."""
    # Far fewer than the `bands` of a finished capture: these rows of all photos are kept in memory,
    # and are estimated again and again between photos.
    wanted = min(height, max(ROWS_PER_BAND, CAMERA_PIXELS // width))
    bands = max(1, wanted // ROWS_PER_BAND)
    if wanted == height:
        return np.arange(height)
    starts = [block.start for block in blocks(height, max(1, height // bands))][:bands]
    rows = [np.arange(start, min(start + ROWS_PER_BAND, height)) for start in starts]
    return np.concatenate(rows)
