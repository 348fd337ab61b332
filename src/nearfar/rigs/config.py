"""Which rig: a scene by name or of Mitsuba, a stored transport, or a RIG.toml that says more."""

import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from nearfar.arrays import Size, parse_size
from nearfar.errors import InputError, MissingFileError, UnreadableFileError
from nearfar.files import kind_of_store
from nearfar.rigs.opening import RealTable, real_rig
from nearfar.rigs.real import Begun, RealRig, Told
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig, World, brightest
from nearfar.scenes import NAMES
from nearfar.scenes.cache import Progress, cached_scene
from nearfar.scenes.mitsuba.loading import load_scene
from nearfar.scenes.mitsuba.photos import RenderedWorld
from nearfar.transport.exact import ExactTransport
from nearfar.transport.exact_store import load_exact
from nearfar.transport.model import Transport
from nearfar.transport.store import KIND as TRANSPORT_KIND
from nearfar.transport.store import load_transport

# Full white reaches this share of the range.
WHITE = 0.9
# A stored transport whose floodlit picture peaks in here is in photo units already.
PHOTO_UNITS = (0.1, 0.95)


class SceneTable(BaseModel):
    """[scene] of a RIG.toml: a built-in scene's name, or a path of what is photographed.

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
    camera: str | None = None
    samples: int | None = Field(default=None, ge=1)

    @field_validator("name")
    @classmethod
    def _a_scene(cls, name: str | None) -> str | None:
        if name is not None and name not in NAMES:
            raise ValueError(f"there is no scene {name!r}, choose one of {', '.join(NAMES)}")
        return name

    @field_validator("camera")
    @classmethod
    def _a_size(cls, camera: str | None) -> str | None:
        if camera is not None:
            parse_size(camera)
        return camera

    @model_validator(mode="after")
    def _one_of_all(self) -> Self:
        if sum(given is not None for given in (self.name, self.transport, self.mitsuba)) != 1:
            raise ValueError(
                "give either name, a built-in scene, transport, a file, or mitsuba, a scene file"
            )
        if self.samples is not None and self.mitsuba is None:
            raise ValueError("samples are those of a Mitsuba scene, remove them")
        return self


class RigTable(BaseModel):
    """A RIG.toml."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    scene: SceneTable
    projector: SimulatedProjector = SimulatedProjector()
    camera: SimulatedCamera = SimulatedCamera()
    exposure: Literal["auto"] | Annotated[float, Field(gt=0.0, allow_inf_nan=False)] | None = None
    seed: int = Field(default=0, ge=0)


def open_rig(rig: str, projector: Size, *, progress: Progress | None = None) -> SimulatedRig:
    """Open the rig that a command names.

    Parameters
    ----------
    rig : str
        Name of a built-in scene; path of a Mitsuba 3 scene (.xml), of a stored transport (.npy,
        .npz, or a Zarr that ``render`` or ``reconstruct`` wrote), or of a RIG.toml.
    projector : Size
        Pattern grid of the plan; a built-in scene is made for it, and a Mitsuba scene's
        projector shows it.
    progress : callable, optional
        Told what a scene's computation does and the share done.

    Returns
    -------
    SimulatedRig

    Raises
    ------
    InputError, MissingFileError, UnreadableFileError
    MissingPackageError
        If a Mitsuba scene is asked for and Mitsuba is not installed.
    """
    if rig in NAMES:
        return _rig(RigTable(scene=SceneTable(name=rig)), Path(), projector, progress)
    path = Path(rig)
    if path.suffix.lower() == ".toml":
        table = read_rig_table(path)
        if isinstance(table, RealTable):
            raise InputError(
                f"{path} is a real rig, and this needs a simulated one: name a scene, or a "
                f"RIG.toml with [scene]."
            )
        return _rig(table, path.parent, projector, progress)
    if not path.exists():
        raise MissingFileError(
            f"{rig} is no rig: name a scene ({', '.join(NAMES)}), a Mitsuba scene, a stored "
            f"transport or a RIG.toml."
        )
    scene = SceneTable(mitsuba=path.name) if is_mitsuba(path) else SceneTable(transport=path.name)
    return _rig(RigTable(scene=scene), path.parent, projector, progress)


@contextmanager
def opened_rig(
    rig: str,
    projector: Size,
    *,
    exposure: float | None = None,
    progress: Progress | None = None,
    told: Told | None = None,
    begun: Begun | None = None,
) -> Iterator[SimulatedRig | RealRig]:
    """Open the rig that a command names, simulated or real, and give its devices back in the end.

    Parameters
    ----------
    rig, projector, progress
        As `open_rig`; or the RIG.toml of a real rig.
    exposure : float, optional
        Of a real rig, in seconds, instead of what its table says.
    told, begun : callable, optional
        Of a real rig: called with each alarm, a sentence; and before the first photo with the
        seconds that each is going to take.

    Raises
    ------
    NearfarError
        As `open_rig` and `nearfar.rigs.opening.real_rig`.
    """
    path = Path(rig)
    table = read_rig_table(path) if path.suffix.lower() == ".toml" else None
    if isinstance(table, RealTable):
        opening = real_rig(path, table, projector, exposure=exposure, told=told, begun=begun)
        with opening as real:
            yield real
    else:
        yield open_rig(rig, projector, progress=progress)


def read_rig_table(path: Path) -> RigTable | RealTable:
    """Read a RIG.toml; one whose camera has a driver is a real rig's.

    Raises
    ------
    MissingFileError, UnreadableFileError
    """
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
        camera = data.get("camera")
        real = "scene" not in data and isinstance(camera, dict) and "driver" in camera
        return (RealTable if real else RigTable).model_validate(data)
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
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        reason = " ".join(str(error).split())
        raise UnreadableFileError(
            f"{path} cannot be read as a rig ({reason}): correct it, it must be TOML in UTF-8."
        ) from None


def _rig(table: RigTable, folder: Path, projector: Size, progress: Progress | None) -> SimulatedRig:
    camera = parse_size(table.scene.camera, name="camera") if table.scene.camera else None
    world: World
    if table.scene.name is not None:
        name = table.scene.name
        world = cached_scene(name, projector, camera, progress=progress)
    elif table.scene.mitsuba is not None:
        path = folder / table.scene.mitsuba
        name = path.name
        world = RenderedWorld(load_scene(path, projector, camera), table.scene.samples, table.seed)
    else:
        path = folder / str(table.scene.transport)
        name = path.name
        world = load_world(path, projector, camera)
    if world.projector != projector:
        raise InputError(
            f"{name} has a projector of {world.projector}, the plan one of {projector}: make the "
            f"plan with --projector {world.projector}."
        )
    exposure = choose_exposure(table.exposure, world, name)
    details = world.describe() if isinstance(world, RenderedWorld) else {}
    return SimulatedRig(world, name, table.projector, table.camera, exposure, table.seed, details)


def is_mitsuba(path: Path) -> bool:
    """Tell a Mitsuba scene from other rigs by its name."""
    return path.suffix.lower() == ".xml"


def notes_of(rig: SimulatedRig | RealRig) -> tuple[str, ...]:
    """Return what a user should know of a rig, a sentence each."""
    world = rig.world if isinstance(rig, SimulatedRig) else None
    return world.notes if isinstance(world, RenderedWorld) else ()


def load_world(
    path: Path, projector: Size | None, camera: Size | None
) -> ExactTransport | Transport:
    """Load a stored transport: a measured one, an exact one, or a dense array."""
    measured = kind_of_store(path) == TRANSPORT_KIND
    world: ExactTransport | Transport = (
        load_transport(path) if measured else load_exact(path, projector=projector, camera=camera)
    )
    if camera is not None and world.camera != camera:
        raise InputError(
            f"{path} has a camera of {world.camera}, the rig says {camera}: correct or remove "
            f"camera."
        )
    return world


def choose_exposure(wanted: float | Literal["auto"] | None, world: World, name: str) -> float:
    """Return photo units per unit of a transport: as wanted, or so that white fits the sensor."""
    if isinstance(wanted, float):
        return wanted
    peak = brightest(world, name)
    if wanted is None and PHOTO_UNITS[0] <= peak <= PHOTO_UNITS[1]:
        return 1.0
    return WHITE / peak
