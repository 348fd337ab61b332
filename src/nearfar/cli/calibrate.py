"""``nearfar calibrate``."""

from pathlib import Path
from typing import Annotated

import typer

from nearfar.arrays import Size
from nearfar.cli.options import Force, Quiet, ScenesCamera, ScenesProjector, size
from nearfar.cli.saying import say, warn
from nearfar.progress import progress_bar

# A board of 7 by 10 squares, as it is often printed, in metres.
BOARD = Size(6, 9)
SQUARE = 0.025


def calibrate(
    rig: Annotated[
        list[Path],
        typer.Argument(
            metavar="RIG.toml",
            help="Rig, projector and camera; for --geometry also the name of a scene, or with "
            "--captures a capture of each pose.",
        ),
    ],
    geometry: Annotated[
        bool,
        typer.Option(
            "--geometry",
            help="Find where camera and projector stand, and their lenses, from photos of a "
            "checkerboard; of a simulated scene they are known.",
        ),
    ] = False,
    captures: Annotated[
        bool,
        typer.Option(
            "--captures", help="The poses are captures that were taken before: name them."
        ),
    ] = False,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="STEREO.yml", help="Where --geometry is written."),
    ] = None,
    board: Annotated[
        Size, typer.Option(parser=size, metavar="HxW", help="Inner corners of the checkerboard.")
    ] = BOARD,
    square: Annotated[
        float,
        typer.Option(metavar="S", help="Side of its squares: depths have the same unit."),
    ] = SQUARE,
    scale: Annotated[
        int,
        typer.Option(
            metavar="N",
            min=1,
            help="Projector pixels along each side of a pattern pixel of --captures.",
        ),
    ] = 1,
    projector: ScenesProjector = None,
    camera: ScenesCamera = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Measure how a rig turns numbers into light, and back; or where its devices stand.

    The calibration and its plots are kept in a folder beside the rig, which acquire reads.
    A simulated RIG.toml is calibrated as a real one, to be tried without hardware.
    With --geometry, STEREO.yml is written, which depth reads. It asks for pose after pose of the
    board, and keeps their photos in a folder beside STEREO.yml.

    Example: nearfar calibrate rig.toml

    Example: nearfar calibrate rig.toml --geometry --board 6x9 --square 0.025 -o stereo.yml

    Example: nearfar calibrate --geometry --captures a.zarr b.zarr c.zarr -o stereo.yml
    """
    from nearfar.cli import calibrate_geometry as by_board

    if not geometry:
        _require_geometry(
            {
                "--captures": captures,
                "--output": output is not None,
                "--board": board != BOARD,
                "--square": square != SQUARE,
                "--scale": scale != 1,
                "--projector": projector is not None,
                "--camera": camera is not None,
            }
        )
    if not captures and len(rig) > 1:
        raise typer.BadParameter("names more than one rig: give one, or captures by --captures.")
    if not geometry:
        _calibrate_light(rig[0], force=force, quiet=quiet)
        return
    if output is None:
        raise typer.BadParameter("--geometry needs it: name STEREO.yml.", param_hint="--output")
    if captures:
        by_board.from_captures(rig, output, (board, square), scale=scale, force=force, quiet=quiet)
    else:
        by_board.of_rig(
            rig[0], output, (board, square), (projector, camera), force=force, quiet=quiet
        )


def _require_geometry(given: dict[str, bool]) -> None:
    for name, is_given in given.items():
        if is_given:
            raise typer.BadParameter("goes with --geometry only.", param_hint=name)


def _calibrate_light(rig: Path, *, force: bool, quiet: bool) -> None:
    from nearfar.files import check_output
    from nearfar.report.calibration import (
        describe_calibration,
        is_calibration,
        write_calibration,
    )
    from nearfar.rigs.calibration import calibration_folder
    from nearfar.rigs.opening import open_rig_to_calibrate
    from nearfar.rigs.tables import read_rig_table
    from nearfar.workflow.calibrate import calibrate as measure

    table = read_rig_table(rig)
    folder = calibration_folder(rig)
    check_output(folder, force=force, replaceable=is_calibration)
    with (
        progress_bar("opening the rig", quiet=quiet) as report,
        open_rig_to_calibrate(rig, table, on_alarm=warn, progress=report) as opened,
    ):
        found = measure(opened, report)
    write_calibration(folder, found, force=force)
    for note in found.notes:
        warn(note)
    say(describe_calibration(found), quiet=quiet)
    say(f"calibration and plots written to {folder}", quiet=quiet)
