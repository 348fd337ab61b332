"""``nearfar separate --capture``."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import typer

from nearfar.arrays import Size
from nearfar.cli.saying import say, warn
from nearfar.cli.separation_steps import compare
from nearfar.progress import progress_bar

if TYPE_CHECKING:
    from nearfar.capture import Capture
    from nearfar.workflow.separate_capture import Dark


class Told(NamedTuple):
    """What the user knows of a capture: black, and a truth to compare with."""

    ambient: Path | None
    black: Path | None
    black_level: float | None
    truth: Path | None
    transport: Path | None
    projector: Size | None


def separate_capture(
    path: Path,
    output: Path,
    told: Told,
    period: int | None,
    *,
    as_json: bool,
    force: bool,
    quiet: bool,
) -> None:
    """Separate a capture, and say which of its photos were used and what looks wrong."""
    from nearfar.capture import open_capture
    from nearfar.workflow.separate import summarise_separation, write_separation
    from nearfar.workflow.separate_capture import separate_capture as take_apart

    _refuse(told)
    capture = open_capture(path)
    dark = _dark(capture, told)
    with progress_bar("separating", quiet=quiet or as_json) as report:
        found = take_apart(capture, dark=dark, period=period, progress=report)
    numbers = dict(found.numbers)
    compared = compare(found.pictures, told.truth, told.transport, None, told.projector)
    numbers["snr"] = compared.snr
    write_separation(output, found.pictures, numbers, force=force)
    quiet = quiet or as_json
    say("\n".join(["used:", *found.used]), quiet=quiet)
    if found.left_out:
        say("\n".join(["left out:", *found.left_out]), quiet=quiet)
    for fault in [*found.faults, *compared.faults]:
        warn(fault)
    if as_json:
        print(json.dumps(numbers, allow_nan=False))
    else:
        say(f"{summarise_separation(numbers)}, written to {output}", quiet=quiet)


def _refuse(told: Told) -> None:
    if told.ambient is not None and told.black is not None:
        raise typer.BadParameter("goes without --ambient.", param_hint="--black")
    if told.black_level is not None and told.ambient is None:
        raise typer.BadParameter("goes with --ambient.", param_hint="--black-level")


def _dark(capture: "Capture", told: Told) -> "Dark | None":
    """Return the photo to subtract, if one was named."""
    from nearfar.workflow.separate_capture import read_dark

    path = told.black or told.ambient
    return None if path is None else read_dark(capture, path, told.black_level or 0.0)
