"""The base class of all cameras: exposure, brackets, averages, auto-exposure.

A driver opens a device and takes single frames; all else is here.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import suppress
from itertools import chain
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from nearfar.errors import DeviceError, InputError, LostPhotoError
from nearfar.photometry.exposures import Sensor, average, merge_exposures
from nearfar.rigs.base import MAXIMUM_TRIES, Photo

# Auto-exposure brings the brightest values to this share of full scale ...
BRIGHT_SHARE = 0.8
# ... all but this share of values, which may be glints.
GLINTS_SHARE = 1e-3
# Values from this share of full scale on are clipped: their light can only be guessed.
CLIPPED_SHARE = 0.98
MAXIMUM_EXPOSURE_STEPS = 10
# An exposure this close to the wanted one, as a share of it, will do.
EXPOSURE_TOLERANCE = 0.05

Frame = NDArray[np.uint8] | NDArray[np.uint16]
FRAME_TYPES = ("uint8", "uint16", "float32")


class Camera(ABC):
    """A camera that takes photos of one exposure, averaged or bracketed as asked.

    A driver implements `take`, and where its device has them `exposure_limits` and
    `_set_exposure`. Cameras are contexts; leaving one gives the device back.

    Parameters
    ----------
    name : str
        What a message calls it.
    frames : int
        Frames that are averaged to a photo.
    bracket : tuple of float
        Exposures of a photo over the first, which is the shortest: (1, 4, 16) takes three.
    """

    # Black level, gain and read noise, for the weights of a bracket; known from a calibration.
    sensor = Sensor()
    # False once a photo's levels were encoded for a screen, as a JPEG's are: not linear in light.
    linear = True

    def __init__(self, name: str, *, frames: int = 1, bracket: tuple[float, ...] = (1.0,)) -> None:
        if frames < 1:
            raise InputError(f"a photo cannot be the average of {frames} frames: give 1 or more.")
        if not bracket or bracket[0] != 1 or list(bracket) != sorted(set(bracket)):
            raise InputError(
                f"the bracket {list(bracket)} is not valid: give 1, the shortest, first, "
                f"then longer ones."
            )
        self.name = name
        self.exposure: float | None = None
        self._frames, self._bracket = frames, bracket

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_fault: object) -> None:
        self.close()

    @property
    @abstractmethod
    def full_scale(self) -> float:
        """Level at which a value is saturated."""

    @abstractmethod
    def take(self) -> Frame:
        """Take a frame, (Cy, Cx, channels), whose exposure begins after this is called.

        Raises
        ------
        LostPhotoError
            If no frame arrives, or not a whole one.
        DeviceError
            If the camera is gone.
        """

    @property
    def exposure_limits(self) -> tuple[float, float] | None:
        """Shortest and longest exposure in seconds; None if it cannot be set."""
        return None

    def describe(self) -> dict[str, Any]:
        """Return the settings that are recorded once in a capture, as JSON types."""
        return {"name": self.name, "frames": self._frames, "bracket": list(self._bracket)}

    def conditions(self) -> dict[str, float]:
        """Return readings recorded with each photo, such as temperatures in degrees Celsius."""
        return {}

    def close(self) -> None:  # noqa: B027
        """Give the device back."""

    def set_exposure(self, seconds: float) -> float:
        """Set the exposure; return the one that the camera really has, in seconds.

        Raises
        ------
        InputError
            If the camera cannot expose so long or so short, or its exposure cannot be set.
        """
        limits = self.exposure_limits
        if limits is None:
            raise InputError(
                f"the exposure of {self.name} cannot be set from here: set it on the camera, and "
                f"leave exposure out of the rig."
            )
        shortest, longest = limits
        if not shortest <= seconds <= longest:
            raise InputError(
                f"{self.name} cannot expose {seconds:g} s: choose from {shortest:g} to "
                f"{longest:g} s."
            )
        self.exposure = self._set_exposure(seconds)
        return self.exposure

    def photograph(self) -> Photo:
        """Take a photo, (Cy, Cx, channels): one frame as it is, or several merged to float32.

        Raises
        ------
        LostPhotoError, DeviceError
            As `take`.
        """
        if len(self._bracket) == 1:
            return self._averaged()
        if self.exposure is None:
            raise InputError(
                f"a bracket needs an exposure that can be set, and that of {self.name} is not "
                f"known: give exposure in the rig."
            )
        shortest, photos, times = self.exposure, [], []
        try:
            for factor in self._bracket:
                times.append(self.set_exposure(factor * shortest))
                photos.append(self._averaged())
        finally:
            self.set_exposure(shortest)
        return merge_exposures(np.stack(photos), times, self.sensor, self.full_scale)

    def take_surely(self) -> Frame:
        """Take a frame; another one, if it is lost.

        Raises
        ------
        LostPhotoError
            If it is lost time and again.
        DeviceError
            As `take`.
        """
        for _ in range(MAXIMUM_TRIES - 1):
            with suppress(LostPhotoError):
                return self._checked(self.take())
        return self._checked(self.take())

    def expose_for_light(self, rounded: Callable[[float], float] = float) -> float:
        """Choose the exposure at which the present light just fits the sensor.

        Parameters
        ----------
        rounded : callable, optional
            Rounds an exposure in seconds, such as to whole refreshes of a projector.

        Returns
        -------
        float
            Seconds.

        Raises
        ------
        DeviceError
            If no exposure will do.
        InputError
            If it cannot be set.
        """
        limits = self.exposure_limits
        if limits is None:
            return self.set_exposure(math.nan)
        shortest, longest = limits
        factor = max(self._bracket)
        wanted = min(max(rounded(math.sqrt(shortest * longest)), shortest), longest / factor)
        for _ in range(MAXIMUM_EXPOSURE_STEPS):
            exposure = self.set_exposure(wanted)
            frame = self.take_surely()
            brightest = float(np.quantile(frame, 1.0 - GLINTS_SHARE))
            reached = (brightest - self.sensor.black) / (self.full_scale - self.sensor.black)
            better = exposure * (
                BRIGHT_SHARE / max(reached, 0.02) if reached < CLIPPED_SHARE else 0.25
            )
            wanted = min(max(rounded(better), shortest), longest / factor)
            if abs(wanted / exposure - 1) < EXPOSURE_TOLERANCE:
                break
        if reached >= CLIPPED_SHARE:
            raise DeviceError(
                f"{self.name} is saturated by white even at {exposure:g} s: close its aperture, "
                f"or make the projector darker."
            )
        if reached < BRIGHT_SHARE / 8:
            raise DeviceError(
                f"{self.name} sees next to nothing of white even at {exposure:g} s: open its "
                f"aperture, take its cap off, and look where it points."
            )
        return exposure

    def _set_exposure(self, seconds: float) -> float:
        """Set the device's exposure; return the one that it really has."""
        raise NotImplementedError

    def _averaged(self) -> Photo:
        if self._frames == 1:
            return self._checked(self.take())
        # Some cameras know their full scale only after a photo.
        first = self._checked(self.take())
        others = (self._checked(self.take()) for _ in range(self._frames - 1))
        return average(chain([first], others), self.full_scale)

    def _checked(self, frame: Frame) -> Frame:
        """Refuse a frame that is no photo, in the name of the camera whose driver made it.

        Raises
        ------
        DeviceError
        """
        values = np.asarray(frame)
        fits = values.ndim == 3 and values.shape[2] in {1, 3} and values.size
        if values.dtype.name not in FRAME_TYPES or not fits:
            raise DeviceError(
                f"{self.name} gives frames of {values.dtype} and shape {values.shape}: its driver "
                f"must return {', '.join(FRAME_TYPES)} of shape (height, width, 1) or "
                f"(height, width, 3)."
            )
        return frame
