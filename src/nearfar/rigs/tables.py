"""RIG.toml: the tables that describe a simulated rig or a real one."""

import tomllib
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from nearfar.errors import MissingFileError, UnreadableFileError
from nearfar.rigs.cameras.driver import SizeText
from nearfar.rigs.cameras.registry import AnyCameraTable
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.scenes import SCENES


class SceneTable(BaseModel):
    """[scene] of a RIG.toml: the scene that is photographed, by its name or by a file.

    Attributes
    ----------
    name : str, optional
        Built-in scene.
    transport : str, optional
        Stored transport, relative to the RIG.toml.
    mitsuba : str, optional
        Mitsuba 3 scene, relative to the RIG.toml; each photo is a rendering.
    camera : str, optional
        Size of the photo, ``HxW``.
    samples : int, optional
        Samples per camera pixel and photo of a Mitsuba scene; the scene's own if left out.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str | None = None
    transport: str | None = None
    mitsuba: str | None = None
    camera: SizeText | None = None
    samples: int | None = Field(default=None, ge=1)

    @field_validator("name")
    @classmethod
    def _require_scene(cls, name: str | None) -> str | None:
        if name is not None and name not in SCENES:
            raise ValueError(f"there is no scene {name!r}, choose one of {', '.join(SCENES)}")
        return name

    @model_validator(mode="after")
    def _require_one(self) -> Self:
        if sum(given is not None for given in (self.name, self.transport, self.mitsuba)) != 1:
            raise ValueError(
                "give either name, a built-in scene, transport, a file, or mitsuba, a scene file"
            )
        if self.samples is not None and self.mitsuba is None:
            raise ValueError("samples are those of a Mitsuba scene, remove them")
        return self


class SimulatedTable(BaseModel):
    """A RIG.toml of a simulated projector and camera."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    scene: SceneTable
    projector: SimulatedProjector = SimulatedProjector()
    camera: SimulatedCamera = SimulatedCamera()
    exposure: Literal["auto"] | Annotated[float, Field(gt=0.0, allow_inf_nan=False)] | None = None
    seed: int = Field(default=0, ge=0)


class ScreenTable(BaseModel):
    """[projector] of a real RIG.toml.

    Attributes
    ----------
    monitor : str or int, optional
        Name or index, as ``nearfar devices`` lists them; the second, or the only one, if left out.
    scale : int, optional
        Side of a pattern pixel in the projector's; the largest that fits if left out.
    brightness : float
        Light of a white pattern over the projector's full white.
    settle : int
        Refreshes from the display of a pattern to the exposure.
    dark : tuple of str or int
        Monitors of other projectors, which are held black.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    monitor: str | int | None = None
    scale: int | None = Field(default=None, ge=1)
    brightness: float = Field(default=1.0, gt=0.0, le=1.0)
    settle: int = Field(default=2, ge=0, le=64)
    dark: tuple[str | int, ...] = ()


class RealTable(BaseModel):
    """A RIG.toml of a real projector and camera."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    projector: ScreenTable = ScreenTable()
    camera: AnyCameraTable


def read_rig_table(path: Path) -> SimulatedTable | RealTable:
    """Read a RIG.toml; one whose camera has a driver is a real rig's.

    Raises
    ------
    MissingFileError, UnreadableFileError
    """
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
        camera = data.get("camera")
        real = "scene" not in data and isinstance(camera, dict) and "driver" in camera
        return (RealTable if real else SimulatedTable).model_validate(data)
    except FileNotFoundError:
        raise MissingFileError(f"{path} is not there: check the name of the rig.") from None
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        message = first["msg"].removeprefix("Value error, ").rstrip(".")
        if first["type"] == "extra_forbidden":
            message = "there is no such key, correct or remove it"
        raise UnreadableFileError(f"{path} is no rig: {where or 'the file'}: {message}.") from None
    except OSError as error:
        raise UnreadableFileError(
            f"{path} cannot be read as a rig ({error.strerror}): check that it is a file you may "
            f"read."
        ) from None
    except (ValueError, RecursionError) as error:
        reason = " ".join(str(error).split())
        raise UnreadableFileError(
            f"{path} cannot be read as a rig ({reason}): correct it, it must be TOML in UTF-8."
        ) from None
