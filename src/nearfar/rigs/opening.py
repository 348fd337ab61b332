"""Open whatever a command names as its rig, simulated or real, and give its devices back."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.rigs.calibration import calibration_folder, read_calibration
from nearfar.rigs.cameras.base import Camera
from nearfar.rigs.cameras.registry import AnyCameraTable
from nearfar.rigs.real import Begun, RealRig, Told
from nearfar.rigs.screens import Window

# Seconds, where a camera begins that is not aimed yet.
FIRST_EXPOSURE = 1 / 30


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
        Refreshes from a pattern's appearance to the exposure.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    monitor: str | int | None = None
    scale: int | None = Field(default=None, ge=1)
    brightness: float = Field(default=1.0, gt=0.0, le=1.0)
    settle: int = Field(default=2, ge=0, le=64)


class RealTable(BaseModel):
    """A RIG.toml of a real projector and camera."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    projector: ScreenTable = ScreenTable()
    camera: AnyCameraTable


@contextmanager
def real_rig(
    path: Path,
    table: RealTable,
    projector: Size,
    *,
    exposure: float | None = None,
    told: Told | None = None,
    begun: Begun | None = None,
) -> Iterator[RealRig]:
    """Open the window and the camera of a real rig.

    Parameters
    ----------
    path : Path
        Its RIG.toml; the calibration lies beside it.
    table : RealTable
    projector : Size
        Pattern grid.
    exposure : float, optional
        In seconds, instead of the table's: what a capture was begun with.
    told : callable, optional
        Called with each alarm, a sentence.
    begun : callable, optional
        Called before the first photo with the seconds that each is going to take.

    Raises
    ------
    MissingPackageError, DeviceError, InputError, UnreadableFileError
    """
    calibration = read_calibration(calibration_folder(path))
    if len(table.camera.bracket) > 1 and (calibration is None or calibration.linearity is None):
        raise InputError(
            f"{path} asks for a bracket, which cannot be merged without the camera's black level: "
            f"run nearfar calibrate first, or remove bracket."
        )
    with _devices(path, table) as (screen, camera):
        yield RealRig(
            screen,
            camera,
            projector,
            calibration=calibration,
            scale=table.projector.scale,
            brightness=table.projector.brightness,
            settle=table.projector.settle,
            exposure=exposure or _wanted(table),
            told=told,
            begun=begun,
        )


@contextmanager
def rig_to_calibrate(
    path: Path, table: RealTable, *, told: Told | None = None
) -> Iterator[RealRig]:
    """Open a real rig as it is: full brightness, one pattern pixel for each of the projector's.

    Raises
    ------
    MissingPackageError, DeviceError, InputError
    """
    # Single frames: averages have another noise, and a bracket needs what is to be found.
    single = {"camera": table.camera.model_copy(update={"average": 1, "bracket": (1.0,)})}
    with _devices(path, table.model_copy(update=single)) as (screen, camera):
        yield _bare(screen, camera, table, _wanted(table), told)


@contextmanager
def rig_to_preview(path: Path, table: RealTable) -> Iterator[RealRig]:
    """Open a real rig as `rig_to_calibrate`, whatever its camera sees: it is to be set up yet.

    Raises
    ------
    MissingPackageError, DeviceError, InputError
    """
    with _devices(path, table) as (screen, camera):
        exposure = _wanted(table)
        if exposure is None and camera.exposure_limits is not None:
            shortest, longest = camera.exposure_limits
            exposure = min(max(FIRST_EXPOSURE, shortest), longest)
        yield _bare(screen, camera, table, exposure, None)


def _bare(
    screen: Window, camera: Camera, table: RealTable, exposure: float | None, told: Told | None
) -> RealRig:
    return RealRig(
        screen,
        camera,
        screen.monitor.size,
        scale=1,
        settle=table.projector.settle,
        exposure=exposure,
        told=told,
    )


def _wanted(table: RealTable) -> float | None:
    """Exposure of the table in seconds; None where it is to be chosen."""
    return None if table.camera.exposure == "auto" else table.camera.exposure


@contextmanager
def _devices(path: Path, table: RealTable) -> Iterator[tuple[Window, Camera]]:
    with ExitStack() as stack:
        # The camera first: it fails more often, and leaves the monitor alone meanwhile.
        camera = stack.enter_context(table.camera.open(path.parent))
        yield stack.enter_context(Window(table.projector.monitor)), camera
