"""GigE Vision and USB3 Vision cameras, by the Aravis library."""

import ctypes
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from nearfar.arrays import Size
from nearfar.errors import DeviceError, InputError, LostPhotoError
from nearfar.files.mosaic import bin_mosaic
from nearfar.rigs.cameras.aravis_library import Aravis, aravis
from nearfar.rigs.cameras.base import Camera, Frame
from nearfar.rigs.cameras.driver import (
    CameraDriver,
    CameraTable,
    FoundCamera,
    PositiveLevel,
    SizeText,
    optional_size,
)
from nearfar.rigs.cameras.pixel_formats import parse_pixel_format

NAME = "aravis"
CONTINUOUS_ACQUISITION = 0
STATUS_SUCCESS = 0  # ARV_BUFFER_STATUS_SUCCESS
REASON_OF_STATUS = {
    1: "nothing of it came",
    2: "it did not come in time",
    3: "packets were lost",
    4: "packets were out of order",
    5: "it was of another size",
    7: "the camera stopped",
}
BUFFER_COUNT = 4
# A frame must arrive within its exposure and this many seconds more.
FRAME_TIMEOUT_SECONDS = 2.0
MICROSECONDS_PER_SECOND = 1e6
# How the library names the types of features that take a Python value.
FEATURE_TYPES: dict[type, list[str]] = {
    int: ["integer", "float"],
    float: ["float", "integer"],
    str: ["string"],
}
SETTINGS = """\
# Rows x columns to read, from the middle of the sensor.
# region = "1080x1440"
# Left out: the format with the most bits that is not packed, Bayer before Mono.
# pixel_format = "Mono12"
# "software", "free" (the camera runs by itself), or the line of a hardware trigger such as "Line1".
# trigger = "software"
# GenICam features to set first.
# features = { Gain = 0.0 }
"""


def find() -> list[FoundCamera]:
    """List the cameras on the network and on USB.

    Raises
    ------
    MissingPackageError
        If Aravis is not installed.
    """
    library = aravis()
    library.plain("arv_update_device_list")
    found = []
    for index in range(library.plain("arv_get_n_devices")):
        words = (
            library.plain(f"arv_get_device_{what}", index) for what in ("id", "vendor", "model")
        )
        device, vendor, model = ((text or b"").decode(errors="replace") for text in words)
        found.append(FoundCamera(NAME, device, f"{vendor} {model}"))
    return found


class AravisCamera(Camera):
    """A GigE Vision or USB3 Vision camera.

    Parameters
    ----------
    device : str, optional
        As `find` returns it, or an address; the first that is found if left out.
    region : Size, optional
        Rows and columns to read, from the middle of the sensor; all if left out.
    pixel_format : str, optional
        Such as Mono16. If left out: the one with the most bits that is not packed, Bayer before
        Mono.
    trigger : str
        "software", one trigger a photo; "free", the camera runs by itself, and the first frame that
        began after the pattern was shown counts; or the line of a hardware trigger, such as Line1.
    features : mapping
        GenICam features to set first, such as Gain or GevSCPSPacketSize.
    full_scale : float, optional
        Level at which it is saturated, where that is less than the pixel format's highest: 12 bits
        at the upper end of Mono16 reach 65520.
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
        region: Size | None = None,
        pixel_format: str | None = None,
        trigger: str = "software",
        features: Mapping[str, bool | int | float | str] | None = None,
        full_scale: float | None = None,
        frames: int = 1,
        bracket: tuple[float, ...] = (1.0,),
    ) -> None:
        super().__init__(
            f"camera {device}" if device else "the camera", frames=frames, bracket=bracket
        )
        self._library: Aravis = aravis()
        self._camera = self._stream = None
        self._full_scale = full_scale
        self._trigger, self._features = trigger, dict(features or {})
        self._wanted_region, self._wanted_format = region, pixel_format
        self._device = device.encode() if device else None
        self._open()

    @property
    def full_scale(self) -> float:
        """Level at which a value is saturated."""
        return self._full_scale or float(2**self._bits - 1)

    @property
    def exposure_limits(self) -> tuple[float, float] | None:
        """Shortest and longest exposure in seconds; None if it cannot be set."""
        if not self._call("arv_camera_is_exposure_time_available", self._camera):
            return None
        low, high = ctypes.c_double(), ctypes.c_double()
        bounds = "arv_camera_get_exposure_time_bounds"
        self._call(bounds, self._camera, ctypes.byref(low), ctypes.byref(high))
        return max(low.value, 1.0) / MICROSECONDS_PER_SECOND, high.value / MICROSECONDS_PER_SECOND

    def describe(self) -> dict[str, Any]:
        """Return the settings that are recorded once in a capture, as JSON types."""
        return {
            **super().describe(),
            "driver": NAME,
            "pixel_format": self._format,
            "region": list(self._region),
            "trigger": self._trigger,
            "features": self._features,
        }

    def conditions(self) -> dict[str, float]:
        """Return the exposure in seconds, and the temperature where the camera reports one."""
        found = {}
        if self.exposure is not None:
            microseconds = self._call("arv_camera_get_exposure_time", self._camera)
            found["exposure"] = microseconds / MICROSECONDS_PER_SECOND
        if self._has("DeviceTemperature"):
            name = b"DeviceTemperature"
            found["temperature"] = self._call("arv_camera_get_float", self._camera, name)
        return found

    def close(self) -> None:
        """Give the camera back."""
        if self._stream is not None:
            self._stop()
            self._library.release(self._stream)
        if self._camera is not None:
            self._library.release(self._camera)
        self._stream = self._camera = None

    def take(self) -> Frame:
        """Take a frame, (Cy, Cx, channels), whose exposure begins after this is called.

        Raises
        ------
        LostPhotoError
            If no frame arrives in time, or with holes. A camera that had stopped answering has
            been opened again by then.
        DeviceError
            If the camera does not answer, and cannot be opened again.
        """
        try:
            return self._triggered()
        except LostPhotoError:
            if not self._is_controlled():
                self._open_again()
            raise
        except DeviceError:
            self._open_again()
            raise LostPhotoError(
                f"{self.name} stopped answering and was opened again: check its cable."
            ) from None

    def _open(self) -> None:
        try:
            # On a machine with several networks, a camera that is opened without this may send
            # nothing.
            self._library.plain("arv_update_device_list")
            if self._device is None and self._library.plain("arv_get_n_devices"):
                # Opened again, it is to be the same camera, not the first that is found by then.
                self._device = self._library.plain("arv_get_device_id", 0)
            self._camera = self._call("arv_camera_new", self._device)
            words = [
                self._call(f"arv_camera_get_{what}", self._camera) or b""
                for what in ("vendor_name", "model_name", "device_serial_number")
            ]
            self.name = " ".join(text.decode(errors="replace") for text in words)
            self._set_up(self._wanted_region, self._wanted_format)
        except BaseException:
            self.close()
            raise

    def _open_again(self) -> None:
        self.close()
        self._open()
        if self.exposure is not None:
            self.exposure = self._set_exposure(self.exposure)

    def _is_controlled(self) -> bool:
        """Tell whether a GigE Vision camera still takes orders from this program.

        It stops doing so when it hears nothing for its heartbeat's timeout, such as while its cable
        is out, and would stay silent from then on.
        """
        if not self._library.plain("arv_camera_is_gv_device", self._camera):
            return True
        device = self._library.plain("arv_camera_get_device", self._camera)
        return bool(self._library.plain("arv_gv_device_is_controller", device))

    def _triggered(self) -> Frame:
        # A frame that came without a trigger belongs to no pattern.
        while old := self._library.plain("arv_stream_try_pop_buffer", self._stream):
            self._library.plain("arv_stream_push_buffer", self._stream, old)
        if self._trigger == "software":
            self._call("arv_camera_software_trigger", self._camera)
        elif self._trigger == "free":
            # The exposure of this one began before the call.
            self._pop()
        return self._pop()

    def _stop(self) -> None:
        # The camera may be gone, or may refuse to stop when it is idle: neither matters here.
        with suppress(DeviceError):
            self._library.call("arv_camera_stop_acquisition", self._camera)

    def _pop(self) -> Frame:
        wait = int(MICROSECONDS_PER_SECOND * ((self.exposure or 0.0) + FRAME_TIMEOUT_SECONDS))
        buffer = self._library.plain("arv_stream_timeout_pop_buffer", self._stream, wait)
        if not buffer:
            raise LostPhotoError(
                f"{self.name} sent no photo within {wait / MICROSECONDS_PER_SECOND:.1f} s: check "
                f"its cable"
                + (", and its trigger." if self._trigger not in {"software", "free"} else ".")
            )
        try:
            status = self._library.plain("arv_buffer_get_status", buffer)
            if status != STATUS_SUCCESS:
                why = REASON_OF_STATUS.get(status, f"status {status}")
                raise LostPhotoError(
                    f"a photo of {self.name} did not arrive whole ({why}): check its cable, and on "
                    f"Ethernet the packet size."
                )
            return self._as_frame(self._copied(buffer))
        finally:
            self._library.plain("arv_stream_push_buffer", self._stream, buffer)

    def _copied(self, buffer: Any) -> NDArray[Any]:
        size = ctypes.c_size_t()
        data = self._library.plain("arv_buffer_get_data", buffer, ctypes.byref(size))
        height = self._library.plain("arv_buffer_get_image_height", buffer)
        width = self._library.plain("arv_buffer_get_image_width", buffer)
        dtype = np.dtype(np.uint8 if self._bits == 8 else "<u2")
        if (height, width) != self._region or size.value < height * width * dtype.itemsize:
            raise LostPhotoError(
                f"a photo of {self.name} is {height}x{width}, not {self._region}: leave the camera "
                f"to this program."
            )
        raw = ctypes.string_at(data, height * width * dtype.itemsize)
        return np.frombuffer(raw, dtype).reshape(height, width)

    def _as_frame(self, levels: NDArray[Any]) -> Frame:
        if self._cell:
            return bin_mosaic(levels, self._cell, self.full_scale)
        return levels[..., np.newaxis]

    def _set_exposure(self, seconds: float) -> float:
        name, microseconds = "arv_camera_set_exposure_time", MICROSECONDS_PER_SECOND * seconds
        self._call(name, self._camera, microseconds)
        return (
            float(self._call("arv_camera_get_exposure_time", self._camera))
            / MICROSECONDS_PER_SECOND
        )

    def _set_up(self, region: Size | None, pixel_format: str | None) -> None:
        # A program that was killed leaves the camera sending to it.
        self._stop()
        # Automatic settings would change between photos.
        for automatic in ("ExposureAuto", "GainAuto", "BalanceWhiteAuto", "GammaEnable"):
            if self._has(automatic):
                self._set_feature(automatic, False if automatic == "GammaEnable" else "Off")
        for name, value in self._features.items():
            if not self._has(name):
                raise InputError(f"{self.name} has no feature {name}: remove it from the rig.")
            self._set_feature(name, value)
        self._format = self._chosen_format(pixel_format)
        self._call("arv_camera_set_pixel_format_from_string", self._camera, self._format.encode())
        chosen = parse_pixel_format(self._format)
        assert chosen is not None
        self._bits, self._cell = chosen
        self._region = self._set_region(region)
        self._call("arv_camera_set_acquisition_mode", self._camera, CONTINUOUS_ACQUISITION)
        if self._trigger == "free":
            self._call("arv_camera_clear_triggers", self._camera)
        else:
            source = "Software" if self._trigger == "software" else self._trigger
            self._call("arv_camera_set_trigger", self._camera, source.encode())
        self._stream = self._call("arv_camera_create_stream", self._camera, None, None)
        payload = self._call("arv_camera_get_payload", self._camera)
        for _ in range(BUFFER_COUNT):
            buffer = self._library.plain("arv_buffer_new_allocate", payload)
            self._library.plain("arv_stream_push_buffer", self._stream, buffer)
        self._call("arv_camera_start_acquisition", self._camera)

    def _chosen_format(self, wanted: str | None) -> str:
        formats = self._library.pixel_formats(self._camera)
        usable = [name for name in formats if parse_pixel_format(name)]
        if wanted is not None and wanted not in usable:
            raise InputError(
                f"{self.name} has no pixel format {wanted!r} that can be read: choose one of "
                f"{', '.join(usable)}."
            )
        if not usable:
            raise DeviceError(
                f"{self.name} has only pixel formats that are packed or processed "
                f"({', '.join(formats)}): none of them can be read."
            )

        def preference(name: str) -> tuple[bool, int]:
            parsed = parse_pixel_format(name)
            assert parsed is not None
            # A colour camera computes Mono by a formula of its own, so raw colours come first.
            return parsed.cell is not None, parsed.bits

        return wanted or max(usable, key=preference)

    def _set_region(self, wanted: Size | None) -> Size:
        sides = [ctypes.c_int(), ctypes.c_int()]
        self._call("arv_camera_get_sensor_size", self._camera, *map(ctypes.byref, sides))
        sensor = Size(sides[1].value, sides[0].value)
        if wanted is None and self._has("OffsetX"):
            # Another program may have left a region set.
            self._call("arv_camera_set_region", self._camera, 0, 0, sensor.width, sensor.height)
        elif wanted is not None:
            if wanted.height > sensor.height or wanted.width > sensor.width:
                raise InputError(
                    f"the region {wanted} is more than the {sensor} of {self.name}: correct it."
                )
            # In the middle, where lenses are best; offsets go by eights on any sensor.
            corner = [
                max(0, (side.value - part) // 16 * 8)
                for side, part in zip(sides, (wanted.width, wanted.height), strict=True)
            ]
            self._call("arv_camera_set_region", self._camera, *corner, wanted.width, wanted.height)
        x, y, w, h = (ctypes.c_int() for _ in range(4))
        self._call("arv_camera_get_region", self._camera, *map(ctypes.byref, (x, y, w, h)))
        got = Size(h.value, w.value)
        if wanted is not None and got != wanted:
            raise InputError(f"{self.name} cannot read {wanted}, only {got}: correct region.")
        return got

    def _has(self, feature: str) -> bool:
        return bool(self._call("arv_camera_is_feature_available", self._camera, feature.encode()))

    def _set_feature(self, name: str, value: bool | float | str) -> None:
        given = value.encode() if isinstance(value, str) else value
        # TOML's 0 and 0.0 are numbers; which of them a feature takes is the camera's affair.
        kinds = ["boolean"] if isinstance(value, bool) else FEATURE_TYPES[type(value)]
        for kind in kinds:
            number = {"integer": int, "float": float}.get(kind, lambda same: same)(given)
            with suppress(DeviceError):
                self._library.call(f"arv_camera_set_{kind}", self._camera, name.encode(), number)
                return
        raise InputError(
            f"{self.name} does not take {value!r} for {name}: look up its range and its kind."
        )

    def _call(self, name: str, *arguments: Any) -> Any:
        try:
            return self._library.call(name, *arguments)
        except DeviceError as error:
            raise DeviceError(
                f"{self.name} does not obey ({error}): check its cable, and that no other "
                f"program uses it."
            ) from None


class AravisTable(CameraTable):
    """[camera] of a GigE Vision or USB3 Vision camera; the settings are those of `AravisCamera`."""

    region: SizeText | None = None
    pixel_format: str | None = None
    trigger: str = "software"
    features: dict[str, bool | int | float | str] = Field(default_factory=dict)
    full_scale: PositiveLevel | None = None

    def open(self, folder: Path) -> Camera:
        """Open the camera; raises as `CameraTable.open`."""
        return AravisCamera(
            self.device,
            region=optional_size(self.region),
            pixel_format=self.pixel_format,
            trigger=self.trigger,
            features=self.features,
            full_scale=self.full_scale,
            frames=self.average,
            bracket=self.bracket,
        )


DRIVER = CameraDriver(AravisTable, find, SETTINGS)
