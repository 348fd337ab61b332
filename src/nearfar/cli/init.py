"""``nearfar init``."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nearfar.cli.options import Force, Quiet
from nearfar.cli.saying import say, warn
from nearfar.errors import InputError

if TYPE_CHECKING:
    pass


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
    from nearfar.rigs.monitors import Monitor, find_monitors

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
        f"camera{'s' * (len(cameras) != 1)} found, {rig} written: check it, then run nearfar "
        f"preview {rig}",
        quiet=quiet,
    )
