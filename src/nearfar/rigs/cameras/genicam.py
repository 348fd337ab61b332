"""Any GenICam camera whose maker gives a GenTL producer (a .cti file), by harvesters."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from nearfar.errors import DeviceError, InputError, LostPhotoError, MissingFileError
from nearfar.files.mosaic import bin_mosaic
from nearfar.packages import needed
from nearfar.rigs.cameras.base import Camera, Frame
from nearfar.rigs.cameras.driver import CameraDriver, CameraTable, PositiveLevel
from nearfar.rigs.cameras.pixel_formats import parse_pixel_format

NAME = "harvesters"
# A frame must arrive within its exposure and this many seconds more.
FRAME_TIMEOUT_SECONDS = 2.0
MICROSECONDS_PER_SECOND = 1e6


class HarvestersCamera(Camera):
    """A camera by a GenTL producer.

    Parameters
    ----------
    producer : Path
        The maker's .cti file.
    device : str, optional
        Serial number; the first camera that is found if left out.
    features : mapping
        GenICam features to set first.
    full_scale : float, optional
        Level at which it is saturated, where that is less than the pixel format's highest.
    frames, bracket
        As `Camera`.

    Raises
    ------
    MissingPackageError, MissingFileError, DeviceError, InputError
    """

    def __init__(
        self,
        producer: Path,
        device: str | None = None,
        *,
        features: Mapping[str, bool | int | float | str] | None = None,
        full_scale: float | None = None,
        frames: int = 1,
        bracket: tuple[float, ...] = (1.0,),
    ) -> None:
        super().__init__(device or "the camera", frames=frames, bracket=bracket)
        with needed(extra="genicam", what="a camera by a GenTL producer"):
            from genicam.genapi import GenericException
            from genicam.gentl import GenericException as ProducerException
            from genicam.gentl import TimeoutException
            from harvesters.core import Harvester
        if not producer.is_file():
            raise MissingFileError(f"{producer} is not there: name the maker's .cti file.")
        self._faults = (GenericException, ProducerException)
        self._late = TimeoutException
        self._harvester: Any = Harvester()
        self._acquirer: Any = None
        self._features, self._full_scale = dict(features or {}), full_scale
        try:
            with self._in_sentences():
                self._harvester.add_file(str(producer))
                self._harvester.update()
                self._require_cameras(producer)
                wanted = {"serial_number": device} if device else 0
                self._acquirer = self._harvester.create(wanted)
                self._nodes: Any = self._acquirer.remote_device.node_map
                self._set_up()
                self._acquirer.start()
        except BaseException:
            self.close()
            raise

    @property
    def full_scale(self) -> float:
        """Level at which a value is saturated."""
        return self._full_scale or float(2**self._bits - 1)

    @property
    def exposure_limits(self) -> tuple[float, float] | None:
        """Shortest and longest exposure in seconds."""
        with self._in_sentences():
            node = self._nodes.ExposureTime
            return max(node.min, 1.0) / MICROSECONDS_PER_SECOND, node.max / MICROSECONDS_PER_SECOND

    def describe(self) -> dict[str, Any]:
        """Return the settings that are recorded once in a capture, as JSON types."""
        return {
            **super().describe(),
            "driver": NAME,
            "pixel_format": self._format,
            "features": self._features,
        }

    def conditions(self) -> dict[str, float]:
        """Return the exposure that the camera reports, in seconds."""
        with self._in_sentences():
            return {"exposure": self._nodes.ExposureTime.value / MICROSECONDS_PER_SECOND}

    def close(self) -> None:
        """Give the camera back."""
        # The camera may be gone already.
        with suppress(*self._faults):
            if self._acquirer is not None:
                self._acquirer.destroy()
            self._harvester.reset()

    def take(self) -> Frame:
        """Take a frame by a software trigger; raises as `Camera.take`."""
        with self._in_sentences():
            self._nodes.TriggerSoftware.execute()
            wait = (self.exposure or 0.0) + FRAME_TIMEOUT_SECONDS
            with self._acquirer.fetch(timeout=wait) as buffer:
                part = buffer.payload.components[0]
                height, width = part.height, part.width
                levels = np.array(part.data).reshape(height, width)
        if self._cell:
            return bin_mosaic(levels, self._cell, self.full_scale)
        return levels[..., np.newaxis]

    def _require_cameras(self, producer: Path) -> None:
        if not self._harvester.device_info_list:
            raise DeviceError(f"{producer} finds no camera: check cable and power.")

    def _set_up(self) -> None:
        for name, value in (
            ("TriggerSelector", "FrameStart"),
            ("TriggerMode", "On"),
            ("TriggerSource", "Software"),
            ("ExposureAuto", "Off"),
            ("GainAuto", "Off"),
            *self._features.items(),
        ):
            node = getattr(self._nodes, name, None)
            if node is None and name in self._features:
                raise InputError(f"{self.name} has no feature {name}: remove it from the rig.")
            if node is not None:
                node.value = value
        self._format = str(self._nodes.PixelFormat.value)
        chosen = parse_pixel_format(self._format)
        if chosen is None:
            raise InputError(
                f"{self.name} sends {self._format}, which is packed or processed: set "
                f"PixelFormat among the features to one such as Mono16 or BayerRG12."
            )
        self._bits, self._cell = chosen

    def _set_exposure(self, seconds: float) -> float:
        with self._in_sentences():
            self._nodes.ExposureTime.value = seconds * MICROSECONDS_PER_SECOND
            return float(self._nodes.ExposureTime.value) / MICROSECONDS_PER_SECOND

    @contextmanager
    def _in_sentences(self) -> Iterator[None]:
        try:
            yield
        except self._late:
            raise LostPhotoError(f"{self.name} sent no photo in time: check its cable.") from None
        except self._faults as error:
            words = " ".join(str(error).split()).rstrip(".")
            raise DeviceError(
                f"{self.name} does not obey ({words}): check its cable, and that no other "
                f"program uses it."
            ) from None


class HarvestersTable(CameraTable):
    """[camera] of a camera by a GenTL producer; the settings are those of `HarvestersCamera`."""

    producer: str
    features: dict[str, bool | int | float | str] = Field(default_factory=dict)
    full_scale: PositiveLevel | None = None

    def open(self, folder: Path) -> Camera:
        """Open the camera; raises as `CameraTable.open`."""
        return HarvestersCamera(
            folder / self.producer,
            self.device,
            features=self.features,
            full_scale=self.full_scale,
            frames=self.average,
            bracket=self.bracket,
        )


DRIVER = CameraDriver(HarvestersTable)
