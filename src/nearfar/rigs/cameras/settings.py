"""The [camera] of a RIG.toml, a table for each driver; opening one loads its packages."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator

from nearfar.arrays import Size, parse_size
from nearfar.errors import MissingPackageError
from nearfar.rigs.cameras.base import Camera, FoundCamera

Seconds = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]


class CameraTable(BaseModel):
    """What every camera's table has.

    Attributes
    ----------
    device : str, optional
        As ``nearfar devices`` prints it; the first that is found if left out.
    exposure : "auto" or float
        Seconds, rounded to whole refreshes of the projector; or as white's photo wants it.
    average : int
        Frames of a photo.
    bracket : tuple of float
        Exposures of a photo over the first and shortest; (1,) is one.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    device: str | None = None
    exposure: Literal["auto"] | Seconds = "auto"
    average: int = Field(default=1, ge=1, le=1000)
    bracket: tuple[Annotated[float, Field(ge=1.0)], ...] = (1.0,)

    @field_validator("bracket")
    @classmethod
    def _rises(cls, bracket: tuple[float, ...]) -> tuple[float, ...]:
        if not bracket or bracket[0] != 1 or list(bracket) != sorted(set(bracket)):
            raise ValueError("a bracket begins with 1, the shortest exposure, and goes up")
        if any(not factor.is_integer() for factor in bracket):
            raise ValueError("a bracket has whole numbers, so that each is of whole refreshes")
        return bracket

    def open(self, folder: Path) -> Camera:
        """Open the camera; paths are relative to `folder`.

        Raises
        ------
        MissingPackageError, DeviceError, InputError
        """
        raise NotImplementedError


class AravisTable(CameraTable):
    """A GigE Vision or USB3 Vision camera; see `nearfar.rigs.cameras.aravis.AravisCamera`."""

    driver: Literal["aravis"]
    region: str | None = None
    pixel_format: str | None = None
    trigger: str = "software"
    features: dict[str, bool | int | float | str] = {}
    full_scale: Annotated[float, Field(gt=0.0)] | None = None

    @field_validator("region")
    @classmethod
    def _a_size(cls, region: str | None) -> str | None:
        if region is not None:
            parse_size(region)
        return region

    def open(self, folder: Path) -> Camera:
        """Open the camera; raises as `CameraTable.open`."""
        from nearfar.rigs.cameras.aravis import AravisCamera

        return AravisCamera(
            self.device,
            region=_size(self.region),
            pixel_format=self.pixel_format,
            trigger=self.trigger,
            features=self.features,
            full_scale=self.full_scale,
            frames=self.average,
            bracket=self.bracket,
        )


class GphotoTable(CameraTable):
    """A camera that gphoto2 drives; see `nearfar.rigs.cameras.gphoto.GphotoCamera`."""

    driver: Literal["gphoto2"]
    settings: dict[str, str | int | float] = {}

    def open(self, folder: Path) -> Camera:
        """Open the camera; raises as `CameraTable.open`."""
        from nearfar.rigs.cameras.gphoto import GphotoCamera

        return GphotoCamera(
            self.device, settings=self.settings, frames=self.average, bracket=self.bracket
        )


class OpencvTable(CameraTable):
    """A webcam, by OpenCV; see `nearfar.rigs.cameras.webcam.OpencvCamera`."""

    driver: Literal["opencv"]
    size: str | None = None
    properties: dict[str, float] = {}
    skip: int = Field(default=4, ge=0)

    @field_validator("size")
    @classmethod
    def _a_size(cls, size: str | None) -> str | None:
        if size is not None:
            parse_size(size)
        return size

    def open(self, folder: Path) -> Camera:
        """Open the camera; raises as `CameraTable.open`."""
        from nearfar.rigs.cameras.webcam import OpencvCamera

        return OpencvCamera(
            self.device,
            size=_size(self.size),
            properties=self.properties,
            skip=self.skip,
            frames=self.average,
            bracket=self.bracket,
        )


class HarvestersTable(CameraTable):
    """Any GenICam camera with a maker's GenTL file; see `nearfar.rigs.cameras.genicam`."""

    driver: Literal["harvesters"]
    producer: str
    features: dict[str, bool | int | float | str] = {}
    full_scale: Annotated[float, Field(gt=0.0)] | None = None

    def open(self, folder: Path) -> Camera:
        """Open the camera; raises as `CameraTable.open`."""
        from nearfar.rigs.cameras.genicam import HarvestersCamera

        return HarvestersCamera(
            folder / self.producer,
            self.device,
            features=self.features,
            full_scale=self.full_scale,
            frames=self.average,
            bracket=self.bracket,
        )


class FolderTable(CameraTable):
    """Any camera whose photos drop into a folder; see `nearfar.rigs.cameras.folder`."""

    driver: Literal["folder"]
    path: str
    command: str | None = None
    patience: Seconds = 30.0
    full_scale: Annotated[float, Field(gt=0.0)] | None = None

    @field_validator("bracket")
    @classmethod
    def _none(cls, bracket: tuple[float, ...]) -> tuple[float, ...]:
        if len(bracket) > 1:
            raise ValueError("whoever drops photos into a folder sets the exposure: remove it")
        return bracket

    def open(self, folder: Path) -> Camera:
        """Open the camera; raises as `CameraTable.open`."""
        from nearfar.rigs.cameras.folder import FolderCamera

        return FolderCamera(
            folder / self.path,
            command=self.command,
            patience=self.patience,
            full_scale=self.full_scale,
            frames=self.average,
        )


AnyCamera = Annotated[
    AravisTable | GphotoTable | OpencvTable | HarvestersTable | FolderTable,
    Field(discriminator="driver"),
]


def find_cameras() -> tuple[list[FoundCamera], list[str]]:
    """List the cameras that each driver finds, and why a driver cannot look.

    Returns
    -------
    found : list of FoundCamera
    unable : list of str
        A sentence for each driver whose packages are missing.
    """
    from nearfar.rigs.cameras import aravis, gphoto, webcam

    found: list[FoundCamera] = []
    unable: list[str] = []
    for driver in (aravis, gphoto, webcam):
        try:
            found += driver.find()
        except MissingPackageError as error:
            unable.append(str(error))
    return found, unable


def _size(text: str | None) -> Size | None:
    return parse_size(text) if text is not None else None
