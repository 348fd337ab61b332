"""Open whatever a command names as its rig, simulated or real, and give its devices back."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from nearfar.arrays import Size
from nearfar.rigs.calibration import Calibration, calibration_folder, read_calibration
from nearfar.rigs.cameras.settings import AnyCamera
from nearfar.rigs.real import Begun, RealRig, Told
from nearfar.rigs.screens import Window


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
    camera: AnyCamera


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
    with _devices(path, table, projector, calibration, exposure, told, begun) as rig:
        yield rig


@contextmanager
def rig_to_calibrate(
    path: Path, table: RealTable, *, told: Told | None = None
) -> Iterator[RealRig]:
    """Open a real rig as it is: full brightness, one pattern pixel for each of the projector's.

    Raises
    ------
    MissingPackageError, DeviceError, InputError
    """
    bare = table.model_copy(
        update={"projector": table.projector.model_copy(update={"brightness": 1.0})}
    )
    with _devices(path, bare, None, None, None, told) as rig:
        yield rig


@contextmanager
def _devices(
    path: Path,
    table: RealTable,
    projector: Size | None,
    calibration: Calibration | None,
    exposure: float | None,
    told: Told | None,
    begun: Begun | None = None,
) -> Iterator[RealRig]:
    with ExitStack() as stack:
        # The camera first: it fails more often, and leaves the monitor alone meanwhile.
        camera = stack.enter_context(table.camera.open(path.parent))
        screen = stack.enter_context(Window(table.projector.monitor))
        wanted: float | Literal["auto"] = table.camera.exposure
        yield RealRig(
            screen,
            camera,
            projector or screen.monitor.size,
            calibration=calibration,
            scale=table.projector.scale if projector else 1,
            brightness=table.projector.brightness,
            settle=table.projector.settle,
            exposure=exposure or (None if wanted == "auto" else wanted),
            told=told,
            begun=begun,
        )
