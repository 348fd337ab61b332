"""How well the photos of a capture relight while it goes on, and what limits them.

A few pictures are shot that no estimate sees. Whenever white and black have come by again, the
transport is estimated from the photos so far, for some rows of the camera, and relit under those
pictures. Each was photographed twice: the errors against both photos have the estimate's own error
in common and no noise, so their product measures it without a model of the noise.

Index convention: photos are (n, rows, Cx, channels), the chosen rows of the camera only.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Integers, blocks
from nearfar.capture import Verdict
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

# Rows of the camera are estimated in bands of so many, since neighbours help each other.
ROWS_PER_BAND = 8
# Camera pixels that are estimated.
CAMERA_PIXELS = 6144
SWEEPS = 2
# The first estimate needs so many photos.
MINIMUM_PHOTOS = 20
# Twice as many photos gain this many dB at most: the next estimate waits for as many as are needed
# at least.
MAXIMUM_GAIN_DECIBELS = 8.0
# A target farther away than this counts as this far: the next estimate comes at twice the photos.
MAXIMUM_MISSING_DECIBELS = 8.0
# An error of more than this factor of what was expected, in power, is the model's.
MODEL_ERROR_RATIO = 2.0
# Without noise in the photos, what is left of the expected error is what was never measured.
NOISE_FACTOR = 1e-3

Limit = Literal["noise", "model", "photos"]


class Standing(NamedTuple):
    """How well a capture would relight if it ended now.

    Attributes
    ----------
    photos : int
    snr : float
        SNR_b in dB, the mean over the pictures that are checked by.
    limit : {"noise", "model", "photos"}
        What most of the error comes from: the noise of the photos, light that the model does not
        hold, or frequencies that were not measured yet.
    fault : str or None
        Why the photos so far could not be judged, a sentence.
    """

    photos: int
    snr: float
    limit: Limit
    fault: str | None = None


class RunningCheck:
    """Follows a capture photo by photo.

    Parameters
    ----------
    plan : Plan
        With pictures to check by; see `nearfar.plan.checks.with_checks`.
    target : float
        SNR_b in dB at which it is enough.
    full_scale : float
        Value of full scale of the photos.
    on_standing : callable, optional
        Called with each `Standing`.
    """

    def __init__(
        self,
        plan: Plan,
        target: float,
        full_scale: float,
        on_standing: Callable[[Standing], None] | None = None,
    ) -> None:
        self.standing: Standing | None = None
        self._plan, self._target, self._full_scale = plan, target, full_scale
        self._on_standing = on_standing
        self._photos: list[NDArray[Any]] = []
        self._rows: Integers = np.zeros(0, dtype=np.int64)
        self._ends = set(ends(plan))
        self._next = MINIMUM_PHOTOS + sum(map(len, check_photos(plan).values()))

    def after_photo(self, number: int, photo: NDArray[Any]) -> Verdict:
        """Take in a photo, (Cy, Cx, channels); it is enough once the target is reached.

        Raises
        ------
        InputError
            If the photos cannot be measured when they are first judged. Later faults are in the
            standing: no photo is given up for them.
        """
        if not self._photos:
            self._rows = some_rows(*photo.shape[:2])
        self._photos.append(photo[self._rows].copy())
        taken = number + 1
        last = taken == len(self._plan.patterns)
        if taken not in self._ends or (taken < self._next and not last):
            return Verdict.CONTINUE
        try:
            self.standing = self._estimate(taken)
        except InputError as error:
            if self.standing is None:
                raise
            self.standing = Standing(taken, -HIGHEST, "photos", str(error))
        if self._on_standing is not None:
            self._on_standing(self.standing)
        missing = self._target - self.standing.snr
        self._next = int(
            taken * 2 ** (np.clip(missing, 0.0, MAXIMUM_MISSING_DECIBELS) / MAXIMUM_GAIN_DECIBELS)
        )
        return Verdict.ENOUGH if missing <= 0 else Verdict.CONTINUE

    def _estimate(self, taken: int) -> Standing:
        kept = PhotosInMemory(self._plan.first(taken), np.stack(self._photos), self._full_scale)
        photos = remove_drift(kept)
        measurements = measure(photos)
        try:
            q = correspond_by_phase(measurements).q
        except InputError:
            # Too few frequencies to settle q yet.
            return Standing(taken, -HIGHEST, "photos")
        plan = self._plan
        found = estimate_jointly(measurements, q, plan.window, plan.far, sweeps=SWEEPS)
        every = slice(0, kept.camera.height)
        values, errors, expected, unmeasured = [], [], 0.0, 0.0
        bars, quiet = ErrorBars(found), ErrorBars(_without_noise(found))
        for numbers in check_photos(kept.plan).values():
            light = self._plan.draw(numbers[0]) / np.float32(255)
            relit = (found @ light).reshape(*kept.camera, -1)
            photographed = photos.read(numbers, every) - _black(measurements)
            signal, error = (_in_common(part) for part in (photographed, photographed - relit))
            values.append(decibels(signal, max(error, 0.0)))
            errors.append(error)
            expected += float(np.mean(bars.picture(light).astype(np.float64) ** 2))
            unmeasured += float(np.mean(quiet.picture(light).astype(np.float64) ** 2))
        limit: Limit = "photos" if unmeasured > expected / 2 else "noise"
        if sum(errors) > MODEL_ERROR_RATIO * expected:
            limit = "model"
        return Standing(taken, float(np.mean(values)), limit)


def some_rows(height: int, width: int) -> Integers:
    """Choose rows of a camera in bands, spread evenly, about `CAMERA_PIXELS` pixels in all."""
    wanted = min(height, max(ROWS_PER_BAND, CAMERA_PIXELS // width))
    bands = max(1, wanted // ROWS_PER_BAND)
    if wanted == height:
        return np.arange(height)
    starts = [block.start for block in blocks(height, max(1, height // bands))][:bands]
    rows = [np.arange(start, min(start + ROWS_PER_BAND, height)) for start in starts]
    return np.concatenate(rows)


def _black(measurements: Measurements) -> Floats:
    return measurements.black.reshape(*measurements.camera, measurements.channels)


def _in_common(photos: Floats) -> float:
    """Mean product of different photos of one picture, (n, rows, Cx, channels), noise left out."""
    flat = photos.reshape(len(photos), -1).astype(np.float64)
    count = len(flat)
    together = np.sum(flat.sum(axis=0) ** 2) - np.sum(flat**2)
    return float(together / (count * (count - 1) * flat.shape[1]))


def _without_noise(found: Transport) -> Transport:
    """Return the estimate with the posterior that photos without noise would give."""
    posterior = found.posterior
    assert posterior is not None
    return replace(
        found,
        noise=NOISE_FACTOR * found.noise,
        posterior=replace(
            posterior,
            offset_noise=NOISE_FACTOR * posterior.offset_noise,
            light_noise=NOISE_FACTOR * posterior.light_noise,
        ),
    )
