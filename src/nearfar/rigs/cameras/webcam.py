"""Webcams and capture cards (UVC), by OpenCV."""

import time
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from nearfar.arrays import Size
from nearfar.errors import DeviceError, InputError, LostPhotoError
from nearfar.packages import needed
from nearfar.rigs.cameras.base import Camera, Frame
from nearfar.rigs.cameras.driver import (
    CameraDriver,
    CameraTable,
    FoundCamera,
    SizeText,
    optional_size,
)

NAME = "opencv"
SETTINGS = """\
# Rows x columns of the picture.
# size = "1080x1920"
# Frames that the camera's queue holds.
# skip = 4
# OpenCV's properties without CAP_PROP_.
# properties = { GAMMA = 100.0, WB_TEMPERATURE = 5000.0 }
"""
# Video4Linux counts exposures in units of 100 microseconds.
EXPOSURE_UNITS_PER_SECOND = 1e4
MANUAL_EXPOSURE = 1
EXPOSURE_LIMITS_SECONDS = (1e-4, 1.0)


def find() -> list[FoundCamera]:
    """List the video devices of Linux, without opening them.

    Raises
    ------
    MissingPackageError
        If OpenCV is not installed.
    """
    _opencv()
    found = []
    for path in sorted(Path("/sys/class/video4linux").glob("video*")):
        # Of the devices of one camera, the first gives pictures.
        if (path / "index").read_text().strip() == "0":
            name = (path / "name").read_text().strip()
            found.append(FoundCamera(NAME, f"/dev/{path.name}", name))
    return found


class OpencvCamera(Camera):
    """A webcam or anything else that OpenCV opens: a device, an address, a file.

    Webcams run by themselves and keep frames in a queue: before each photo, enough are skipped that
    the next was exposed afterwards. Their 8 bits are those of a screen unless the camera's gamma
    can be set to 1.

    Parameters
    ----------
    device : str, optional
        Number, path or address; 0 if left out.
    size : Size, optional
        Picture to ask for.
    properties : mapping
        OpenCV's properties by name without CAP_PROP_, such as GAIN, GAMMA or WB_TEMPERATURE.
    skip : int
        Frames that the queue holds.
    frames, bracket
        As `Camera`.

    Raises
    ------
    MissingPackageError, DeviceError, InputError
    """

    def __init__(
        self,
        device: str | None = None,
        *,
        size: Size | None = None,
        properties: Mapping[str, float] | None = None,
        skip: int = 4,
        frames: int = 1,
        bracket: tuple[float, ...] = (1.0,),
    ) -> None:
        super().__init__(f"camera {device or 0}", frames=frames, bracket=bracket)
        self._opencv = cv2 = _opencv()
        self._skip, self._properties = skip, dict(properties or {})
        source: int | str = 0 if device is None else device
        self._source = int(source) if str(source).isdigit() else source
        self._capture = cv2.VideoCapture(self._source)
        if not self._capture.isOpened():
            raise DeviceError(
                f"{self.name} cannot be opened: check that it is connected, that you may use it, "
                f"and that no other program does."
            )
        try:
            self._set_up(size)
        except BaseException:
            self.close()
            raise

    @property
    def full_scale(self) -> float:
        """Highest level: 8 bits."""
        return 255.0

    @property
    def exposure_limits(self) -> tuple[float, float] | None:
        """Shortest and longest exposure that such cameras have; None where it cannot be set."""
        can = self._capture.get(self._opencv.CAP_PROP_EXPOSURE) > 0
        return EXPOSURE_LIMITS_SECONDS if can else None

    def describe(self) -> dict[str, Any]:
        """Return the settings that are recorded once in a capture, as JSON types."""
        return {
            **super().describe(),
            "driver": NAME,
            "source": str(self._source),
            "properties": self._properties,
        }

    def close(self) -> None:
        """Give the camera back."""
        self._capture.release()

    def take(self) -> Frame:
        """Take a frame, (Cy, Cx, 3), red first.

        Raises
        ------
        LostPhotoError
            If none comes.
        """
        for _ in range(self._skip):
            self._capture.grab()
        there, frame = self._capture.read()
        if not there or frame is None:
            raise LostPhotoError(f"{self.name} gives no more frames: check its cable.")
        levels: NDArray[np.uint8] = np.atleast_3d(frame)[..., ::-1].copy()
        return levels

    def _set_up(self, size: Size | None) -> None:
        cv2, capture = self._opencv, self._capture
        # Where a device has no such property, nothing happens.
        for automatic, manual in (
            ("AUTO_EXPOSURE", MANUAL_EXPOSURE),
            ("AUTO_WB", 0),
            ("BUFFERSIZE", 1),
        ):
            capture.set(getattr(cv2, f"CAP_PROP_{automatic}"), manual)
        if size is not None:
            capture.set(cv2.CAP_PROP_FRAME_HEIGHT, size.height)
            capture.set(cv2.CAP_PROP_FRAME_WIDTH, size.width)
        for name, value in self._properties.items():
            number = getattr(cv2, f"CAP_PROP_{name.upper()}", None)
            if number is None or not capture.set(number, value):
                raise InputError(f"{self.name} has no property {name} to set: remove it.")
        got = Size(
            int(capture.get(cv2.CAP_PROP_FRAME_HEIGHT)), int(capture.get(cv2.CAP_PROP_FRAME_WIDTH))
        )
        if size is not None and got != size:
            raise InputError(f"{self.name} gives {got}, not {size}: correct size.")

    def _set_exposure(self, seconds: float) -> float:
        number = self._opencv.CAP_PROP_EXPOSURE
        if not self._capture.set(number, round(seconds * EXPOSURE_UNITS_PER_SECOND)):
            raise DeviceError(f"{self.name} does not let its exposure be set.")
        # The exposure of the next frame started before this one was set.
        time.sleep(seconds)
        return float(self._capture.get(number)) / EXPOSURE_UNITS_PER_SECOND


def _opencv() -> ModuleType:
    with needed(extra="webcam", what="a camera by OpenCV"):
        import cv2
    return cv2


class OpencvTable(CameraTable):
    """[camera] of a webcam by OpenCV; the settings are those of `OpencvCamera`."""

    size: SizeText | None = None
    properties: dict[str, float] = Field(default_factory=dict)
    skip: int = Field(default=4, ge=0)

    def open(self, folder: Path) -> Camera:
        """Open the camera; raises as `CameraTable.open`."""
        return OpencvCamera(
            self.device,
            size=optional_size(self.size),
            properties=self.properties,
            skip=self.skip,
            frames=self.average,
            bracket=self.bracket,
        )


DRIVER = CameraDriver(OpencvTable, find, SETTINGS)
