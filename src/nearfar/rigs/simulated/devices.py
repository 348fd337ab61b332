"""A simulated rig's screen and camera, each by itself, as a real rig has them.

What is done with devices before there is a plan, calibration and preview, can so be tried without
hardware.

Index convention: frames are (Py, Px) or (Py, Px, 3), 8 bits; photos (Cy, Cx, channels).
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size
from nearfar.rigs.cameras.base import Camera, Frame
from nearfar.rigs.linear import PRIMARY_COUNT
from nearfar.rigs.monitors import DEFAULT_REFRESH_RATE, Monitor
from nearfar.rigs.simulated.rig import SimulatedRig

# The exposure at which photos have the light of the simulated rig's own.
UNIT_SECONDS = 0.5
SHORTEST_SECONDS, LONGEST_SECONDS = 1 / DEFAULT_REFRESH_RATE, 20.0


class SimulatedScreen:
    """Holds the frame that is shown.

    Parameters
    ----------
    projector : Size
    pause : callable
        Lets time pass, in seconds.
    """

    def __init__(self, projector: Size, pause: Callable[[float], object]) -> None:
        self._pause = pause
        self.monitor = Monitor(0, "simulated", projector, (0, 0), DEFAULT_REFRESH_RATE)
        self.frame: NDArray[np.uint8] = np.zeros(projector, dtype=np.uint8)

    @property
    def period(self) -> float:
        """Seconds from one refresh to the next."""
        return 1 / DEFAULT_REFRESH_RATE

    def show(self, frame: NDArray[np.uint8]) -> None:
        """Show a frame."""
        self.frame = frame.copy()

    def wait(self, seconds: float) -> None:
        """Let time pass."""
        self._pause(seconds)

    def close(self) -> None:
        """Do nothing: there is no monitor to give back."""


class SceneCamera(Camera):
    """Photographs a simulated rig's scene under the frame on a simulated screen.

    Parameters
    ----------
    rig : SimulatedRig
    screen : SimulatedScreen
    """

    def __init__(self, rig: SimulatedRig, screen: SimulatedScreen) -> None:
        super().__init__(f"the simulated camera of {rig.name}")
        self._rig, self._screen = rig, screen
        self._taken = 0
        self._newest: tuple[NDArray[np.uint8], Floats] | None = None

    @property
    def full_scale(self) -> float:
        """Highest level of the sensor."""
        return self._rig.full_scale

    @property
    def exposure_limits(self) -> tuple[float, float]:
        """Shortest and longest exposure in seconds."""
        return SHORTEST_SECONDS, LONGEST_SECONDS

    def take(self) -> Frame:
        """Take a photo of the frame that is shown."""
        sensor, number = self._rig.sensor, self._taken
        self._taken += 1
        # All light counts for as long as the exposure is, ambient light too.
        seconds = UNIT_SECONDS if self.exposure is None else self.exposure
        light = self._rig.exposure * self._picture() * self._rig.optics.lamp_drift.at(number)
        electrons = sensor.expose(light, number) * (seconds / UNIT_SECONDS)
        generator = np.random.default_rng([self._rig.seed, number])
        return sensor.sensor(sensor.noise(electrons, generator))

    def _set_exposure(self, seconds: float) -> float:
        return seconds

    def _picture(self) -> Floats:
        """Return the scene's picture under the frame, which a preview shows again and again."""
        frame = self._screen.frame
        if self._newest is None or not np.array_equal(self._newest[0], frame):
            coloured = np.broadcast_to(np.atleast_3d(frame), (*frame.shape[:2], PRIMARY_COUNT))
            self._newest = frame, self._under(self._rig.optics.emit(coloured))
        return self._newest[1]

    def _under(self, light: Floats) -> Floats:
        """Return the scene's picture under a light, (Py, Px, 3).

        A camera's channel sees the projector's primary of the same number; a grey camera sees the
        mean of all.
        """
        world = self._rig.world
        grey: Floats = world.pictures(light.mean(axis=-1)[None])[0]
        if grey.shape[-1] != PRIMARY_COUNT or np.ptp(light, axis=-1).max() == 0:
            return grey
        each = [world.pictures(light[None, ..., i])[0, ..., i] for i in range(PRIMARY_COUNT)]
        return np.asarray(np.stack(each, axis=-1))
