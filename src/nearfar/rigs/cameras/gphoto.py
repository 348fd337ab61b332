"""Cameras with a shutter of their own (DSLR, mirrorless), by libgphoto2."""

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from types import ModuleType
from typing import Any

from pydantic import Field

from nearfar.errors import DeviceError, InputError, LostPhotoError, UnreadableFileError
from nearfar.files.photos import decode_camera_file
from nearfar.packages import needed
from nearfar.rigs.cameras.base import Camera, Frame
from nearfar.rigs.cameras.driver import CameraDriver, CameraTable, FoundCamera

NAME = "gphoto2"
SETTINGS = """\
# Settings by gphoto2's names; 'gphoto2 --list-config' lists them.
# settings = { iso = "100", "f-number" = "f/8" }
"""
# Names of the same setting on cameras of several makers.
EXPOSURE_SETTINGS = ("shutterspeed", "shutterspeed2")
FORMAT_SETTINGS = ("imageformat", "imagequality")
RAW_FORMAT = re.compile(r"^(raw|nef|nef \(raw\)|arw)$", re.IGNORECASE)
TRANSFER_TARGET = ("capturetarget", re.compile(r"internal ram|sdram", re.IGNORECASE))
EXPOSURE_CHOICE = re.compile(r"^(?P<over>[\d.]+)(/(?P<under>[\d.]+))?\s*s?$")
# Error codes after which another try may succeed.
TRANSIENT_ERRORS = (-1, -7, -10, -110)


def find() -> list[FoundCamera]:
    """List the cameras that libgphoto2 finds.

    Raises
    ------
    MissingPackageError
        If gphoto2 is not installed.
    """
    gphoto = _gphoto()
    found = gphoto.Camera.autodetect()
    return [FoundCamera(NAME, found.get_value(i), found.get_name(i)) for i in range(found.count())]


class GphotoCamera(Camera):
    """A camera that libgphoto2 drives.

    Photos are asked for as raw files where the camera has them. Its exposures are those of its
    dial; the nearest is chosen.

    Parameters
    ----------
    device : str, optional
        Port, as `find` returns it; the first camera that is found if left out.
    settings : mapping
        gphoto2's settings to set first, such as iso or f-number.
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
        settings: Mapping[str, str | int | float] | None = None,
        frames: int = 1,
        bracket: tuple[float, ...] = (1.0,),
    ) -> None:
        super().__init__("the camera", frames=frames, bracket=bracket)
        self._gphoto = _gphoto()
        self._settings = dict(settings or {})
        self._full_scale: float | None = None
        self._camera = self._gphoto.Camera()
        try:
            with self._in_sentences():
                if device is not None:
                    ports = self._gphoto.PortInfoList()
                    ports.load()
                    self._camera.set_port_info(ports[ports.lookup_path(device)])
                self._camera.init()
                self.name = str(self._camera.get_abilities().model)
            self._set_up()
        except BaseException:
            self.close()
            raise

    @property
    def full_scale(self) -> float:
        """Level at which a photo is saturated; found by a photo."""
        if self._full_scale is None:
            self.take_surely()
        assert self._full_scale is not None
        return self._full_scale

    @property
    def exposure_limits(self) -> tuple[float, float] | None:
        """Shortest and longest exposure in seconds; None if it has no such dial."""
        speeds = self._speeds()
        return (min(speeds), max(speeds)) if speeds else None

    def describe(self) -> dict[str, Any]:
        """Return the settings that are recorded once in a capture, as JSON types."""
        return {**super().describe(), "driver": NAME, "settings": self._settings}

    def close(self) -> None:
        """Give the camera back."""
        # The camera may be gone already.
        with suppress(self._gphoto.GPhoto2Error):
            self._camera.exit()

    def take(self) -> Frame:
        """Take a photo, and bring it over.

        Raises
        ------
        LostPhotoError
            If the camera was busy, or what came is no photo.
        DeviceError
            If it does not answer.
        """
        gphoto = self._gphoto
        with self._in_sentences():
            path = self._camera.capture(gphoto.GP_CAPTURE_IMAGE)
            file = self._camera.file_get(path.folder, path.name, gphoto.GP_FILE_TYPE_NORMAL)
            data = bytes(memoryview(file.get_data_and_size()))
        with self._in_sentences():
            # Nine hundred photos would fill the card.
            self._camera.file_delete(path.folder, path.name)
        try:
            photo = decode_camera_file(data, Path(path.name))
        except UnreadableFileError as error:
            raise LostPhotoError(str(error)) from None
        self._full_scale, self.linear = photo.full_scale, photo.linear
        return photo.levels

    def _set_up(self) -> None:
        with self._in_sentences():
            # Photos go through the camera's memory: its card cannot slow them down or fill up.
            self._choose_matching(*TRANSFER_TARGET)
            for name in FORMAT_SETTINGS:
                self._choose_matching(name, RAW_FORMAT)
        for name, value in self._settings.items():
            self._set(name, str(value))

    def _set_exposure(self, seconds: float) -> float:
        speeds = self._speeds()
        nearest = min(speeds, key=lambda speed: abs(speed - seconds))
        name = next(n for n in EXPOSURE_SETTINGS if self._widget(n) is not None)
        self._set(name, speeds[nearest])
        return nearest

    def _speeds(self) -> dict[float, str]:
        """Return the exposures of the dial in seconds, with its names of them."""
        for name in EXPOSURE_SETTINGS:
            widget = self._widget(name)
            if widget is not None:
                return {
                    seconds: choice
                    for choice in _choices(widget)
                    if (seconds := seconds_of(choice)) is not None
                }
        return {}

    def _set(self, name: str, value: str) -> None:
        widget = self._widget(name)
        if widget is None:
            raise InputError(
                f"{self.name} has no setting {name}: 'gphoto2 --list-config' lists them."
            )
        choices = _choices(widget)
        if choices and value not in choices:
            some = ", ".join(choices[:12])
            raise InputError(f"{self.name} has no {name} {value!r}: choose one of {some}.")
        with self._in_sentences():
            widget.set_value(value)
            self._camera.set_single_config(name, widget)
            kept = str(self._camera.get_single_config(name).get_value())
        if kept != value:
            raise DeviceError(
                f"{self.name} keeps {name} at {kept} instead of {value}: set it to manual."
            )

    def _choose_matching(self, name: str, wanted: re.Pattern[str]) -> None:
        widget = self._widget(name)
        if widget is not None:
            choice = next((c for c in _choices(widget) if wanted.search(c)), None)
            if choice is not None:
                self._set(name, choice)

    def _widget(self, name: str) -> Any:
        try:
            return self._camera.get_single_config(name)
        except self._gphoto.GPhoto2Error as error:
            if error.code == self._gphoto.GP_ERROR_BAD_PARAMETERS:
                return None
            raise self._fault(error) from None

    @contextmanager
    def _in_sentences(self) -> Iterator[None]:
        try:
            yield
        except self._gphoto.GPhoto2Error as error:
            raise self._fault(error) from None

    def _fault(self, error: Any) -> DeviceError:
        if error.code == self._gphoto.GP_ERROR_IO_USB_CLAIM:
            return DeviceError(
                f"{self.name} is in use by another program: end it (on many desktops, pkill -f "
                f"gvfs-gphoto2)."
            )
        if error.code == self._gphoto.GP_ERROR_MODEL_NOT_FOUND:
            return DeviceError(
                "no camera is found: connect it by USB, turn it on, and set it to PTP."
            )
        kind = LostPhotoError if error.code in TRANSIENT_ERRORS else DeviceError
        return kind(
            f"{self.name} does not obey ({str(error.string).rstrip('.')}): check its cable, "
            f"battery and card, and that it focuses by hand."
        )


def seconds_of(choice: str) -> float | None:
    """Read an exposure as cameras write it: 1/250, 0.0040s, 2.5, 10/25; None if it is none."""
    match = EXPOSURE_CHOICE.match(choice.strip())
    if match is None:
        return None
    over, under = float(match["over"]), float(match["under"] or 1)
    return over / under if over > 0 and under > 0 else None


def _choices(widget: Any) -> list[str]:
    try:
        return [widget.get_choice(i) for i in range(widget.count_choices())]
    except _gphoto().GPhoto2Error:
        return []


def _gphoto() -> ModuleType:
    with needed(extra="gphoto2", what="a camera by gphoto2"):
        import gphoto2
    library: ModuleType = gphoto2
    return library


class GphotoTable(CameraTable):
    """[camera] of a camera that gphoto2 drives; the settings are those of `GphotoCamera`."""

    settings: dict[str, str | int | float] = Field(default_factory=dict)

    def open(self, folder: Path) -> Camera:
        """Open the camera; raises as `CameraTable.open`."""
        return GphotoCamera(
            self.device, settings=self.settings, frames=self.average, bracket=self.bracket
        )


DRIVER = CameraDriver(GphotoTable, find, SETTINGS)
