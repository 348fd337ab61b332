"""``nearfar devices`` and ``nearfar calibrate``: real projectors and cameras."""

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nearfar.cli.options import Browser, Force, Port, Quiet
from nearfar.cli.saying import say, warn
from nearfar.errors import InputError
from nearfar.progress import progress_bar

if TYPE_CHECKING:
    from nearfar.workflow.calibrate import Findings

RigFile = Annotated[Path, typer.Argument(metavar="RIG.toml", help="Rig, projector and camera.")]


def devices(quiet: Quiet = False) -> None:
    """List the monitors and cameras that are found.

    Example: nearfar devices
    """
    from nearfar.errors import DeviceError, MissingPackageError
    from nearfar.rigs.cameras.registry import find_cameras
    from nearfar.rigs.screens import find_monitors

    say("monitors:", quiet=quiet)
    try:
        for monitor in find_monitors():
            say(f"  {monitor}", quiet=quiet)
    except (DeviceError, MissingPackageError) as error:
        warn(str(error))
    found, unable = find_cameras()
    say("cameras:", quiet=quiet)
    for camera in found:
        about = f'driver = "{camera.driver}", device = "{camera.device}"'
        say(f"  {about}: {camera.name}", quiet=quiet)
    if not found:
        say("  none is found: connect one, turn it on, and look again", quiet=quiet)
    for sentence in unable:
        warn(sentence)


def init(
    rig: Annotated[Path, typer.Argument(metavar="RIG.toml", help="Rig to write.")] = Path(
        "rig.toml"
    ),
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Write a RIG.toml with comments for the projector and the camera that are found.

    Example: nearfar init rig.toml
    """
    from nearfar.errors import DeviceError, MissingPackageError
    from nearfar.files import check_output, new_output
    from nearfar.rigs.cameras.registry import find_cameras
    from nearfar.rigs.initial import draft_rig
    from nearfar.rigs.screens import Monitor, find_monitors

    if rig.suffix.lower() != ".toml":
        raise InputError(f"{rig} does not end in .toml: choose a name such as rig.toml.")
    check_output(rig, force=force)
    monitors: tuple[Monitor, ...] = ()
    try:
        monitors = find_monitors()
    except (DeviceError, MissingPackageError) as error:
        warn(str(error))
    cameras, unable = find_cameras()
    for sentence in unable:
        warn(sentence)
    with new_output(rig, force=force) as partial:
        partial.write_text(draft_rig(monitors, cameras), encoding="utf-8")
    say(
        f"{len(monitors)} monitor{'s' * (len(monitors) != 1)} and {len(cameras)} "
        f"camera{'s' * (len(cameras) != 1)} found, {rig} written: look it over, then nearfar "
        f"preview {rig}",
        quiet=quiet,
    )


def calibrate(rig: RigFile, force: Force = False, quiet: Quiet = False) -> None:
    """Measure how a rig's projector and camera turn numbers into light, and back.

    The calibration and its plots are kept in a folder beside the rig, which acquire reads.

    Example: nearfar calibrate rig.toml
    """
    from nearfar.files import check_output
    from nearfar.report.calibration import is_calibration, write_calibration
    from nearfar.rigs.calibration import calibration_folder
    from nearfar.rigs.config import read_rig_table
    from nearfar.rigs.opening import RealTable, rig_to_calibrate
    from nearfar.workflow.calibrate import calibrate as measure

    table = read_rig_table(rig)
    if not isinstance(table, RealTable):
        raise InputError(
            f"{rig} is a simulated rig, whose response is what projector.gamma says: name the "
            f"RIG.toml of a real one."
        )
    folder = calibration_folder(rig)
    check_output(folder, force=force, replaceable=is_calibration)
    with (
        progress_bar("opening the rig", quiet=quiet) as report,
        rig_to_calibrate(rig, table, told=warn) as opened,
    ):
        found = measure(opened, report)
    write_calibration(folder, found, force=force)
    for note in found.notes:
        warn(note)
    say(_told(found), quiet=quiet)
    say(f"calibration and plots written to {folder}", quiet=quiet)


def preview(
    rig: RigFile,
    port: Port = 8627,
    browser: Browser = True,
    quiet: Quiet = False,
) -> None:
    """Show what the camera sees, live: picture, histogram, focus and saturation.

    Example: nearfar preview rig.toml
    """
    import webbrowser

    from nearfar.rigs.config import read_rig_table
    from nearfar.rigs.opening import RealTable, rig_to_preview
    from nearfar.viewer.preview import run_preview

    table = read_rig_table(rig)
    if not isinstance(table, RealTable):
        raise InputError(
            f"{rig} is a simulated rig, which needs no focus: name the RIG.toml of a real one."
        )

    def started(address: str) -> None:
        print(f"preview at {address}, Esc on the projector or Ctrl-C here ends it", flush=True)
        if browser:
            webbrowser.open(address)

    # Esc on the projector and Ctrl-C are how a preview ends.
    with rig_to_preview(rig, table) as opened, suppress(KeyboardInterrupt):
        run_preview(opened, port, started)
    say("preview ended", quiet=quiet)


def _told(found: "Findings") -> str:
    """Say in lines what a calibration found."""
    known = found.calibration
    half = sum(row[0] < 0.5 for row in known.response)
    lines = [
        f"half of white's light at level {half} of 255; straightened to "
        f"{known.residual:.2%} of white",
        f"red, green and blue together: {1 + known.superposition:.1%} of white",
        f"camera: black level {known.black:.4g}, {known.gain:.4g} levels an electron, read noise "
        f"{known.read:.3g} levels",
        f"light under black: {known.ambient:.2%} of full scale",
    ]
    if known.exposure is not None:
        lines.append(f"exposure {known.exposure:.4g} s")
    if known.linearity is not None:
        lines.append(f"camera linear to {known.linearity:.2%} of full scale")
    return "\n".join(lines)
