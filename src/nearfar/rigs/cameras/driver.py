"""The interface of camera drivers: their settings, and how they find their cameras."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, field_validator

from nearfar.arrays import Size, parse_size
from nearfar.rigs.cameras.base import Camera

Seconds = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
PositiveLevel = Annotated[float, Field(gt=0.0)]


def _require_size(text: str) -> str:
    parse_size(text)
    return text


# A size as a table writes it, HxW.
SizeText = Annotated[str, AfterValidator(_require_size)]


class FoundCamera(NamedTuple):
    """A camera that is connected.

    Attributes
    ----------
    driver, device : str
        What to write as ``driver`` and ``device`` in a RIG.toml.
    name : str
        Maker and model.
    """

    driver: str
    device: str
    name: str


class CameraTable(BaseModel):
    """[camera] of a RIG.toml: the settings of all drivers; each driver adds its own.

    Attributes
    ----------
    driver : str
        Name in `nearfar.rigs.cameras.registry.CAMERAS`.
    device : str, optional
        As ``nearfar devices`` prints it; the first that is found if left out.
    exposure : "auto" or float
        Seconds, rounded to whole refreshes of the projector; "auto" fits it to a white pattern.
    average : int
        Frames that are averaged to one photo.
    bracket : tuple of float
        Exposures of a photo over the first and shortest; (1,) is a single exposure.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    driver: str
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
        """Open the camera; paths in the table are relative to `folder`.

        Raises
        ------
        MissingPackageError, DeviceError, InputError
        """
        raise NotImplementedError


@dataclass(frozen=True)
class CameraDriver:
    """A way to drive cameras, as a registry holds it.

    Loading it must not load the packages that the cameras themselves need.

    Attributes
    ----------
    table : type of CameraTable
        The [camera] table of its cameras; its method `open` opens one.
    find : callable, optional
        Lists the cameras that are connected, as `FoundCamera`, without opening them. It raises
        `MissingPackageError` where a package is missing. Without it cameras are not searched for.
    settings : str
        TOML for a new RIG.toml: the driver's own settings with a comment each, all commented out.
    """

    table: type[CameraTable]
    find: Callable[[], Sequence[FoundCamera]] | None = None
    settings: str = ""


def optional_size(text: str | None) -> Size | None:
    """Read a size of a table, ``HxW``; None where it is left out."""
    return parse_size(text) if text is not None else None
