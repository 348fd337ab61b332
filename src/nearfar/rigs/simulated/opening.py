"""Open a simulated rig: before a scene by name, a Mitsuba scene or a stored transport."""

from pathlib import Path
from typing import Literal

from nearfar.arrays import Size, parse_size
from nearfar.errors import InputError
from nearfar.files import kind_of_store
from nearfar.progress import Report
from nearfar.rigs.calibration import Calibration
from nearfar.rigs.simulated.rig import SimulatedRig, World, brightest
from nearfar.rigs.tables import SimulatedTable
from nearfar.scenes import sizes
from nearfar.scenes.cache import cached_known
from nearfar.scenes.mitsuba.loading import load_scene
from nearfar.scenes.mitsuba.photos import RenderedWorld
from nearfar.transport.exact_store import load_exact
from nearfar.transport.known import KnownTransport
from nearfar.transport.model import Transport
from nearfar.transport.store import load_transport
from nearfar.transport.store_format import KIND as TRANSPORT_KIND

# An exposure that is chosen brings the brightest camera pixel under full white to this share of
# full scale.
WHITE_LEVEL = 0.9
# A stored transport whose brightest pixel under full white lies in here is in photo units already.
WHITE_LEVELS_OF_PHOTO_UNITS = (0.1, 0.95)


def open_simulated_rig(
    table: SimulatedTable,
    folder: Path,
    projector: Size,
    *,
    calibration: Calibration | None = None,
    progress: Report | None = None,
) -> SimulatedRig:
    """Open a simulated rig.

    Parameters
    ----------
    table : SimulatedTable
    folder : Path
        What paths in the table are relative to.
    projector : Size
        Pattern grid.
    calibration : Calibration, optional
        By which patterns are drawn; without one the projector is taken as linear.
    progress : callable, optional
        Called with what is computed of a scene, and the share of it that is done.

    Raises
    ------
    InputError
        If the scene has another pattern grid, or is black under full white.
    MissingFileError, UnreadableFileError
    MissingPackageError
        If it is a Mitsuba scene and Mitsuba is not installed.
    """
    camera = parse_size(table.scene.camera, name="camera") if table.scene.camera else None
    world: World
    if table.scene.name is not None:
        name = table.scene.name
        world = cached_known(name, projector, camera, progress=progress)
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
            f"plan with `projector={tuple(world.projector)}`."
        )
    rendered = world if isinstance(world, RenderedWorld) else None
    return SimulatedRig(
        world,
        name,
        table.projector,
        table.camera,
        exposure=choose_exposure(table.exposure, world, name),
        seed=table.seed,
        details=rendered.describe() if rendered else {},
        notes=rendered.notes if rendered else (),
        calibration=calibration,
    )


def projector_of(table: SimulatedTable, folder: Path) -> Size:
    """Return the pattern grid of a simulated rig where no plan says it: its scene's own.

    Raises
    ------
    MissingFileError, UnreadableFileError, MissingPackageError
        As `open_simulated_rig`.
    """
    scene = table.scene
    if scene.name is not None:
        return sizes(scene.name)[0]
    if scene.mitsuba is not None:
        return load_scene(folder / scene.mitsuba).projector
    return load_world(folder / str(scene.transport), None, None).projector


def load_world(
    path: Path, projector: Size | None, camera: Size | None
) -> KnownTransport | Transport:
    """Load a stored transport: a measured one, an exact one, or a dense array."""
    measured = kind_of_store(path) == TRANSPORT_KIND
    world: KnownTransport | Transport = (
        load_transport(path) if measured else load_exact(path, projector=projector, camera=camera)
    )
    if camera is not None and world.camera != camera:
        raise InputError(
            f"{path} has a camera of {world.camera}, the rig says {camera}: correct or remove "
            f"camera."
        )
    return world


def choose_exposure(wanted: float | Literal["auto"] | None, world: World, name: str) -> float:
    """Return photo units per unit of a transport: as wanted, or so that white fits the sensor.

    Parameters
    ----------
    wanted : float, "auto" or None
        Without one, a transport that is in photo units already stays as it is.
    world : World
    name : str
        What the world is called in a message.
    """
    if isinstance(wanted, float):
        return wanted
    peak = brightest(world, name)
    lowest, highest = WHITE_LEVELS_OF_PHOTO_UNITS
    if wanted is None and lowest <= peak <= highest:
        return 1.0
    return WHITE_LEVEL / peak
