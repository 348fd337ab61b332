"""A real rig: a screen and a camera in step.

Index convention: patterns are (Py, Px), photos (Cy, Cx, channels) in raw levels.
"""

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.faults.records import ExposureBeats, NotLinearLight
from nearfar.illumination.frames import FrameLayout, fit_frame
from nearfar.rigs.base import Photo
from nearfar.rigs.calibration import Calibration
from nearfar.rigs.cameras.base import Camera
from nearfar.rigs.linear import LinearProjector, identity
from nearfar.rigs.monitors import Monitor
from nearfar.rigs.real.alarms import AlarmLog
from nearfar.rigs.real.black_and_white import BlackAndWhite
from nearfar.rigs.real.shoot import CheckedShoot
from nearfar.rigs.real.shutter import Shutter
from nearfar.rigs.real.superposition import check_superposition
from nearfar.rigs.real.synchronising import MAXIMUM_SETTLE_REFRESHES, synchronise
from nearfar.rigs.screens import Screen


def _layout(projector: Size, scale: int | None, monitor: Monitor) -> FrameLayout:
    try:
        return fit_frame(projector, scale, monitor.size)
    except InputError:
        raise InputError(
            f"a pattern grid of {projector} with {scale or 1}x{scale or 1} projector pixels for "
            f"each of its own does not fit on the monitor {monitor.name} of {monitor.size}: lower "
            f"scale under [projector] of the rig, or make a plan for a smaller grid."
        ) from None


class RealRig:
    """A projector's screen and a camera.

    It is a context: leaving it gives both back.

    Parameters
    ----------
    screen : Screen
    camera : Camera
    projector : Size
        Pattern grid.
    calibration : Calibration, optional
        Response of the projector and levels of the camera; without one both are taken as linear.
    scale : int, optional
        Side of a pattern pixel on the screen; the largest that fits if left out.
    brightness : float
        Light of a white pattern over the projector's full white.
    settle : int
        Refreshes from the display of a pattern to the exposure; more where photos show that more
        are needed.
    exposure : float, optional
        In seconds, rounded to whole refreshes; fitted to a white pattern if left out.
    draw : callable, optional
        Draws the frame of an 8-bit pattern; by default by `calibration` and `brightness`.
    on_alarm : callable, optional
        Called with each alarm, a sentence.
    on_start : callable, optional
        Called before the first photo with the seconds that each will take.

    Attributes
    ----------
    camera : Camera
    layout : FrameLayout
        Where the pattern grid lies on the screen.

    Raises
    ------
    InputError
        If the pattern grid does not fit on the screen, or the camera cannot expose so long.
    DeviceError
        If white does not fit the camera at any exposure.
    """

    def __init__(
        self,
        screen: Screen,
        camera: Camera,
        projector: Size,
        *,
        calibration: Calibration | None = None,
        scale: int | None = None,
        brightness: float = 1.0,
        settle: int = 2,
        exposure: float | None = None,
        draw: Callable[[NDArray[np.uint8]], NDArray[np.uint8]] | None = None,
        on_alarm: Callable[[str], None] | None = None,
        on_start: Callable[[float], None] | None = None,
    ) -> None:
        self._screen, self.camera, self._projector = screen, camera, projector
        self._alarms, self._on_start = AlarmLog(on_alarm), on_start
        self.layout: FrameLayout = _layout(projector, scale, screen.monitor)
        self._calibration, self._brightness = calibration, brightness
        response = calibration.response_table() if calibration else identity()
        self._draw = draw or LinearProjector(response, self.layout, brightness).draw
        if calibration is not None:
            camera.sensor = calibration.sensor
        self._shutter = Shutter(screen, camera, settle, self._alarms)
        self._conditions: dict[str, float] = {}
        self._set_exposure(exposure)
        self._devices = ExitStack()
        self._devices.callback(camera.close)
        self._devices.callback(screen.close)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_fault: object) -> None:
        self.close()

    def close(self) -> None:
        """Give the projector and the camera back."""
        self._devices.close()

    @property
    def projector(self) -> Size:
        """Pattern grid."""
        return self._projector

    @property
    def monitor(self) -> Monitor:
        """The output that the projector is connected to."""
        return self._screen.monitor

    @property
    def full_scale(self) -> float:
        """Level of the camera that stands for 1."""
        return self.camera.full_scale

    @property
    def refresh(self) -> float:
        """Seconds from one refresh of the projector to the next."""
        return self._screen.period

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on the rig before photos are taken: none."""
        return ()

    @property
    def alarms(self) -> list[str]:
        """Faults so far, a sentence each."""
        return self._alarms.sentences

    def describe(self) -> dict[str, Any]:
        """Return the settings of the rig that are recorded in a capture, as JSON types."""
        monitor, calibration = self._screen.monitor, self._calibration
        return {
            "kind": "real",
            "projector": {
                "monitor": monitor.name,
                "size": list(monitor.size),
                "refresh": monitor.refresh,
                "scale": self.layout.scale,
                "brightness": self._brightness,
            },
            "camera": self.camera.describe(),
            "exposure": self.camera.exposure,
            "calibration": calibration.made if calibration else None,
            # Relighting in colour uses it.
            "colour_mixing": [list(row) for row in calibration.mixing] if calibration else None,
        }

    def conditions(self) -> dict[str, float]:
        """Return readings recorded with the last photo, such as temperatures in degrees Celsius."""
        return self._conditions

    def shoot(self, patterns: Iterable[NDArray[np.uint8]], first: int = 0) -> Iterator[Photo]:
        """Display each 8-bit pattern and yield its photo, (Cy, Cx, channels), in order.

        Black, white, greys and halves come before all patterns: they show whether photos follow
        the projector, how long it takes to settle, and whether light adds up.

        Raises
        ------
        DeviceError
            If the projector or the camera does not do what it should.
        KeyboardInterrupt
            If Esc was pressed.
        """
        levels = self.synchronise()
        shoot = CheckedShoot(
            self._shutter, self._draw, self._projector, levels, self._alarms, first
        )
        shoot.begin_after_halves(*self._check_linearity(levels))
        for number, pattern in enumerate(patterns, first):
            photo = shoot.photograph(number, pattern)
            self._conditions = self.camera.conditions()
            shoot.follow_light(number, pattern, photo)
            yield photo

    def synchronise(self) -> BlackAndWhite:
        """Find after how long photos follow the projector, and what black and white look like.

        Raises
        ------
        DeviceError
            If photos do not follow, or white is no brighter than black.
        """
        frames = self.frame(0), self.frame(255)
        found = synchronise(self._shutter.photograph, *frames, self._shutter.settle)
        self._shutter.settle = found.settle
        return found.levels

    def photograph(self, frame: NDArray[np.uint8]) -> Photo:
        """Display a frame as it is and photograph it once it has settled.

        Parameters
        ----------
        frame : array, shape (height, width) or (height, width, 3)

        Raises
        ------
        DeviceError
            If the photo is lost time and again.
        """
        return self._shutter.photograph(frame)

    def photograph_levels(self, levels: tuple[int, int, int]) -> Photo:
        """Fill the pattern grid with levels of red, green and blue, as they are; photograph it."""
        frame = np.zeros((*self.layout.frame, 3), dtype=np.uint8)
        height, width = (self.layout.scale * side for side in self._projector)
        top, left = ((a - b) // 2 for a, b in zip(self.layout.frame, (height, width), strict=True))
        frame[top : top + height, left : left + width] = levels
        return self.photograph(frame)

    def wait(self, seconds: float) -> None:
        """Let time pass; raises KeyboardInterrupt if Esc was pressed."""
        self._screen.wait(seconds)

    def whole_refreshes(self, seconds: float) -> float:
        """Round an exposure to whole refreshes of the projector, one at least."""
        if _is_whole(seconds, self.refresh):
            # Exactly as it was asked for, or as the capture was started with.
            return seconds
        return max(1, round(seconds / self.refresh)) * self.refresh

    def frame(self, level: int) -> NDArray[np.uint8]:
        """Draw the frame of a pattern of one level, linear in light."""
        return self._draw(np.full(self._projector, level, dtype=np.uint8))

    def _check_linearity(self, levels: BlackAndWhite) -> tuple[Photo, Photo]:
        """Note whether light adds up; return photos of the left half of white and the right."""
        if not self.camera.linear:
            self._alarms.add(NotLinearLight(self.camera.name))
        start, photos = time.monotonic(), 0

        def photograph(pattern: NDArray[np.uint8]) -> Photo:
            nonlocal photos
            photos += 1
            return self._shutter.photograph(self._draw(pattern))

        found = check_superposition(
            photograph, self._projector, levels, is_calibrated=self._calibration is not None
        )
        for fault in found.faults:
            self._alarms.add(fault)
        if self._on_start is not None:
            self._on_start((time.monotonic() - start) / photos)
        return found.left, found.right

    def _set_exposure(self, wanted: float | None) -> None:
        camera, refresh = self.camera, self.refresh
        if wanted is not None:
            camera.set_exposure(self.whole_refreshes(wanted))
        elif camera.exposure_limits is not None:
            self._screen.show(self.frame(255))
            self._screen.wait(max(MAXIMUM_SETTLE_REFRESHES, self._shutter.settle) * refresh)
            camera.expose_for_light(self.whole_refreshes)
        if camera.exposure is not None and not _is_whole(camera.exposure, refresh):
            self._alarms.add(ExposureBeats(camera.name, camera.exposure, refresh))


def _is_whole(seconds: float, refresh: float) -> bool:
    """Return whether an exposure is a whole number of refreshes, to a hundredth or a tenth."""
    refreshes = seconds / refresh
    whole = round(refreshes)
    return whole >= 1 and abs(refreshes - whole) < min(0.1, 0.01 * refreshes)
