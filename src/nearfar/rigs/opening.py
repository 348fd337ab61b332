"""Open a rig by its name or file, simulated or real."""

import os
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

from nearfar.arrays import AnyPath, AnySize, Size, as_size
from nearfar.checks import as_number
from nearfar.errors import InputError, MissingFileError
from nearfar.progress import Report
from nearfar.rigs.calibration import calibration_folder, read_calibration
from nearfar.rigs.cameras.base import Camera
from nearfar.rigs.real.rig import RealRig
from nearfar.rigs.screens import Window
from nearfar.rigs.simulated.devices import UNIT_SECONDS, SceneCamera, SimulatedScreen
from nearfar.rigs.simulated.opening import open_simulated_rig, projector_of
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.rigs.tables import RealTable, SceneTable, SimulatedTable, read_rig_table
from nearfar.scenes import SCENES

# First exposure of a camera that is not aimed yet, if the camera has it.
PREVIEW_EXPOSURE_SECONDS = 1 / 30


def open_rig(
    rig: AnyPath,
    projector: AnySize,
    *,
    exposure: float | None = None,
    progress: Report | None = None,
    on_alarm: Callable[[str], None] | None = None,
    on_start: Callable[[float], None] | None = None,
) -> SimulatedRig | RealRig:
    """Open a rig: a projector and a camera, simulated or real.

    A rig is a context: leaving it gives its devices back. A simulated rig has none, and works
    without ``with`` too.

    Parameters
    ----------
    rig : str or Path
        Name of a scene; path of a Mitsuba 3 scene (.xml), of a stored transport (.npy, .npz, or a
        Zarr that ``render`` or ``reconstruct`` wrote), or of a RIG.toml.
    projector : Size or (height, width)
        Pattern grid of the plan. A scene by name is made for it, a Mitsuba scene's projector
        displays it, and so does a real one in blocks of its pixels.
    exposure : float, optional
        Of a real camera, in seconds, instead of what its RIG.toml says.
    progress : callable, optional
        Called with what is computed of a scene, and the share of it that is done, 0 to 1.
    on_alarm : callable, optional
        Called by a real rig with each alarm, a sentence.
    on_start : callable, optional
        Called by a real rig before the first photo with the seconds that each will take.

    Returns
    -------
    SimulatedRig or RealRig

    Raises
    ------
    InputError
        If a transport has another projector, or the pattern grid does not fit on the real one.
    MissingFileError, UnreadableFileError
    MissingPackageError
        If a package is not installed: Mitsuba's, the window's or the camera's.
    DeviceError
        If the projector or the camera is not there or does not do what it should.

    Examples
    --------
    >>> with nearfar.open_rig("scene.npy", (8, 8)) as rig:
    ...     again = nearfar.acquire(plan, "again.zarr", rig)
    """
    projector = as_size(projector, "projector")
    if exposure is not None and as_number(exposure, "the exposure") <= 0:
        raise InputError(f"the exposure is {exposure} seconds: give one above 0.")
    if not isinstance(rig, str | os.PathLike):
        raise InputError(
            f"a {type(rig).__name__} was given for the rig: give the name of a scene, or the path "
            f"of a transport or of a RIG.toml."
        )
    name, path = os.fspath(rig), Path(rig)
    require_rig(name)
    table: SimulatedTable | RealTable
    if name in SCENES:
        table = SimulatedTable(scene=SceneTable(name=name))
    elif path.suffix.lower() == ".toml":
        table = read_rig_table(path)
    elif is_mitsuba(path):
        table = SimulatedTable(scene=SceneTable(mitsuba=path.name))
    else:
        table = SimulatedTable(scene=SceneTable(transport=path.name))
    if isinstance(table, SimulatedTable):
        is_file = name not in SCENES and path.suffix.lower() == ".toml"
        calibration = read_calibration(calibration_folder(path)) if is_file else None
        return open_simulated_rig(
            table, path.parent, projector, calibration=calibration, progress=progress
        )
    return open_real_rig(
        path, table, projector, exposure=exposure, on_alarm=on_alarm, on_start=on_start
    )


def require_rig(name: str) -> None:
    """Refuse what is neither the name of a scene nor a file.

    Raises
    ------
    MissingFileError
    """
    if name not in SCENES and Path(name).suffix.lower() != ".toml" and not Path(name).exists():
        raise MissingFileError(
            f"{name} is no rig: name a scene ({', '.join(SCENES)}), a Mitsuba scene, a stored "
            f"transport or a RIG.toml."
        )


def opened_rig(
    rig: str,
    projector: AnySize,
    *,
    exposure: float | None = None,
    progress: Report | None = None,
    told: Callable[[str], None] | None = None,
    begun: Callable[[float], None] | None = None,
) -> SimulatedRig | RealRig:
    """Open a rig as a context; `open_rig` does so too.

    .. deprecated:: 0.1
        Use `open_rig`.

    Parameters
    ----------
    rig, projector, exposure, progress
        As `open_rig`.
    told, begun : callable, optional
        `on_alarm` and `on_start` of `open_rig`.

    Returns
    -------
    SimulatedRig or RealRig
    """
    return open_rig(
        rig, projector, exposure=exposure, progress=progress, on_alarm=told, on_start=begun
    )


def is_mitsuba(path: Path) -> bool:
    """Return whether a path is that of a Mitsuba scene, by its ending."""
    return path.suffix.lower() == ".xml"


def open_real_rig(
    path: Path,
    table: RealTable,
    projector: Size,
    *,
    exposure: float | None = None,
    on_alarm: Callable[[str], None] | None = None,
    on_start: Callable[[float], None] | None = None,
) -> RealRig:
    """Open the window and the camera of a real rig.

    Parameters
    ----------
    path : Path
        Its RIG.toml; the calibration lies beside it.
    table : RealTable
        Contents of `path`.
    projector, exposure, on_alarm, on_start
        As `open_rig`.

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

    def set_up(screen: Window, camera: Camera) -> RealRig:
        return RealRig(
            screen,
            camera,
            projector,
            calibration=calibration,
            scale=table.projector.scale,
            brightness=table.projector.brightness,
            settle=table.projector.settle,
            exposure=exposure_of(table) if exposure is None else exposure,
            on_alarm=on_alarm,
            on_start=on_start,
        )

    return _open_devices(path, table, set_up)


def open_rig_to_calibrate(
    path: Path,
    table: RealTable | SimulatedTable,
    *,
    on_alarm: Callable[[str], None] | None = None,
    progress: Report | None = None,
) -> RealRig:
    """Open a rig without its calibration, one pattern pixel for each of the projector's.

    A simulated one has a screen and a camera of its own, and takes no time; `progress` is called
    while its scene is computed.

    Raises
    ------
    MissingPackageError, DeviceError, InputError
    MissingFileError, UnreadableFileError
        If a simulated rig's scene is not there, or damaged.
    """
    if isinstance(table, SimulatedTable):
        return _simulated_devices(path, table, lambda _seconds: None, on_alarm, progress)
    # Single frames: averages have another noise, and a bracket needs the black level, which is
    # still to be found.
    single = table.camera.model_copy(update={"average": 1, "bracket": (1.0,)})

    def set_up(screen: Window, camera: Camera) -> RealRig:
        return _uncalibrated(screen, camera, table, exposure_of(table), on_alarm)

    return _open_devices(path, table.model_copy(update={"camera": single}), set_up)


def open_rig_to_preview(
    path: Path, table: RealTable | SimulatedTable, *, progress: Report | None = None
) -> RealRig:
    """Open a rig as `open_rig_to_calibrate`, whatever its camera sees: it is not aimed yet.

    A simulated one takes the time that a real projector would.

    Raises
    ------
    MissingPackageError, DeviceError, InputError, MissingFileError, UnreadableFileError
        As `open_rig_to_calibrate`.
    """
    if isinstance(table, SimulatedTable):
        return _simulated_devices(path, table, time.sleep, None, progress)

    def set_up(screen: Window, camera: Camera) -> RealRig:
        exposure = exposure_of(table)
        if exposure is None and camera.exposure_limits is not None:
            shortest, longest = camera.exposure_limits
            exposure = min(max(PREVIEW_EXPOSURE_SECONDS, shortest), longest)
        return _uncalibrated(screen, camera, table, exposure, None)

    return _open_devices(path, table, set_up)


def _simulated_devices(
    path: Path,
    table: SimulatedTable,
    pause: Callable[[float], object],
    on_alarm: Callable[[str], None] | None,
    progress: Report | None,
) -> RealRig:
    """Return a simulated rig's screen and camera as a real rig, exposed as the simulated one."""
    folder = path.parent
    rig = open_simulated_rig(table, folder, projector_of(table, folder), progress=progress)
    screen = SimulatedScreen(rig.projector, pause)
    return RealRig(
        screen,
        SceneCamera(rig, screen),
        rig.projector,
        scale=1,
        exposure=UNIT_SECONDS,
        on_alarm=on_alarm,
    )


def _uncalibrated(
    screen: Window,
    camera: Camera,
    table: RealTable,
    exposure: float | None,
    on_alarm: Callable[[str], None] | None,
) -> RealRig:
    return RealRig(
        screen,
        camera,
        screen.monitor.size,
        scale=1,
        settle=table.projector.settle,
        exposure=exposure,
        on_alarm=on_alarm,
    )


def exposure_of(table: RealTable) -> float | None:
    """Return the exposure of the table in seconds; None where it is to be chosen."""
    return None if table.camera.exposure == "auto" else table.camera.exposure


def _open_devices(
    path: Path, table: RealTable, set_up: Callable[[Window, Camera], RealRig]
) -> RealRig:
    """Open the devices and set up a rig of them; give them back if anything fails."""
    with ExitStack() as stack:
        # The camera first: it fails more often, and leaves the monitor alone meanwhile.
        camera = stack.enter_context(table.camera.open(path.parent))
        window = Window(table.projector.monitor, table.projector.dark)
        rig = set_up(stack.enter_context(window), camera)
        # The rig closes them from here on.
        stack.pop_all()
    return rig
