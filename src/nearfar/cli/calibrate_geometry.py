"""``nearfar calibrate --geometry``: STEREO.yml, from a scene, a rig or captures."""

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from nearfar.arrays import Size, parse_size
from nearfar.cli.options import keep_input
from nearfar.cli.saying import say, warn
from nearfar.errors import InputError
from nearfar.progress import progress_bar

if TYPE_CHECKING:
    from nearfar.rigs.base import Rig
    from nearfar.workflow.geometry.board import Board
    from nearfar.workflow.geometry.calibrate import GeometryFindings
    from nearfar.workflow.geometry.poses import Pose

# Rows and columns of inner corners, and the side of a square.
BoardOptions = tuple[Size, float]
FINISHED = "f"
# What the name of a pose's capture begins with.
POSE = "pose-"


def from_captures(
    captures: Sequence[Path],
    output: Path,
    board: BoardOptions,
    *,
    scale: int,
    force: bool,
    quiet: bool,
) -> None:
    """Calibrate by captures of a board, one for each pose."""
    from nearfar.capture import open_capture
    from nearfar.files import check_output
    from nearfar.workflow.geometry.calibrate import calibrate_geometry
    from nearfar.workflow.geometry.poses import pose_in

    keep_input(output, *captures)
    check_output(output, force=force)
    seen, poses = _board(board), []
    with progress_bar("poses", quiet=quiet) as report:
        for number, path in enumerate(captures):
            poses.append(pose_in(open_capture(path), seen))
            report("poses", (number + 1) / len(captures))
    _write(calibrate_geometry(poses, scale=scale), output, force=force, quiet=quiet)


def of_rig(
    rig: Path,
    output: Path,
    board: BoardOptions,
    sizes: tuple[Size | None, Size | None],
    *,
    force: bool,
    quiet: bool,
) -> None:
    """Write the geometry of a simulated scene, or calibrate a real rig pose by pose."""
    from nearfar.files import check_output
    from nearfar.rigs.opening import open_rig_to_calibrate
    from nearfar.rigs.tables import RealTable, read_rig_table
    from nearfar.scenes import SCENES
    from nearfar.workflow.geometry.calibrate import calibrate_geometry

    check_output(output, force=force)
    if str(rig) in SCENES:
        _of_scene(str(rig), sizes, output, force=force, quiet=quiet)
        return
    keep_input(output, rig)
    table = read_rig_table(rig)
    if not isinstance(table, RealTable):
        if table.scene.name is None:
            raise InputError(
                f"{rig} does not tell where its camera and projector stand: name a built-in scene."
            )
        camera = parse_size(table.scene.camera) if table.scene.camera else sizes[1]
        _of_scene(table.scene.name, (sizes[0], camera), output, force=force, quiet=quiet)
        return
    if not sys.stdin.isatty():
        raise InputError(
            f"poses of the board are asked for on a terminal, and this is none: photograph them by "
            f"nearfar acquire with --rig {quote(str(rig))}, and name the captures by --captures."
        )
    seen, folder = _board(board), output.with_suffix(".poses")
    check_output(folder, force=force, replaceable=_is_of_poses)
    # Gray code needs no linear light, of which a rig without calibration warns; captures keep it.
    with open_rig_to_calibrate(rig, table) as opened:
        poses = shoot_poses(opened, opened.projector, folder, seen, input, quiet=quiet)
    try:
        found = calibrate_geometry(poses)
    except InputError as fault:
        raise InputError(
            f"{str(fault).removesuffix('.')}; the photos are kept in {folder}, go on with them by "
            f"--captures."
        ) from None
    _write(found, output, force=force, quiet=quiet)


def shoot_poses(
    rig: "Rig",
    projector: Size,
    folder: Path,
    board: "Board",
    ask: Callable[[str], str],
    *,
    quiet: bool,
) -> "list[Pose]":
    """Photograph pose after pose of a board, as long as a user asks for more.

    Parameters
    ----------
    rig : Rig
    projector : Size
        The projector's pixels.
    folder : Path
        Folder to make, of a capture for each pose.
    board : Board
    ask : callable
        Shows a question and returns the answer, a line.
    quiet : bool

    Returns
    -------
    list of Pose
        Those in which the board was found.
    """
    from nearfar.workflow.acquire import acquire
    from nearfar.workflow.geometry.poses import plan_of_poses, pose_in

    plan, number = plan_of_poses(projector), 1
    poses: list[Pose] = []
    folder.mkdir(exist_ok=True)
    while True:
        question = f"pose {number}: place the board and press Enter"
        if poses:
            question += f", or type {FINISHED} and press Enter to calibrate by {len(poses)} poses"
        try:
            answer = ask(f"{question}: ")
        except EOFError:
            return poses
        if answer.strip().lower() == FINISHED:
            return poses
        with progress_bar("photos", quiet=quiet) as report:
            path = folder / f"{POSE}{number}.zarr"
            capture = acquire(plan, path, rig, force=True, progress=report, on_alarm=warn)
        try:
            poses.append(pose_in(capture, board))
        except InputError as fault:
            warn(f"{str(fault).removesuffix('.')}; this pose is taken again.")
            continue
        say(f"{len(poses[-1].places)} corners found", quiet=quiet)
        number += 1


def _is_of_poses(folder: Path) -> bool:
    """Return whether a folder holds poses alone, which may be replaced."""
    return all(entry.name.startswith(POSE) for entry in folder.iterdir())


def _board(options: BoardOptions) -> "Board":
    from nearfar.workflow.geometry.board import Board, require_board
    from nearfar.workflow.geometry.opencv import opencv

    board = Board(*options)
    require_board(board)
    # Told before any photo is taken, if it is missing.
    opencv()
    return board


def _of_scene(
    name: str,
    sizes: tuple[Size | None, Size | None],
    output: Path,
    *,
    force: bool,
    quiet: bool,
) -> None:
    from nearfar.scenes.stereo import stereo_of_scene
    from nearfar.stereo import save_stereo_calibration

    stereo = stereo_of_scene(name, *sizes)
    save_stereo_calibration(stereo, output, force=force)
    say(
        f"geometry of {name}, camera {stereo.camera.size}, projector {stereo.projector.size}, "
        f"baseline {stereo.baseline:.4g} m, written to {output}",
        quiet=quiet,
    )


def _write(found: "GeometryFindings", output: Path, *, force: bool, quiet: bool) -> None:
    from nearfar.stereo import save_stereo_calibration

    save_stereo_calibration(found.stereo, output, force=force)
    for note in found.notes:
        warn(note)
    say(f"{found.describe()}\nwritten to {output}", quiet=quiet)
