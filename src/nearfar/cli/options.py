"""Options that several commands share."""

from collections.abc import Sequence
from os.path import realpath
from pathlib import Path
from shlex import quote
from typing import Annotated

import typer

from nearfar.arrays import Size, parse_size
from nearfar.cli.saying import warn
from nearfar.errors import InputError, UnreadableFileError


def size(text: str | Size) -> Size:
    """Read a size written HxW; a bad one is wrong usage."""
    if isinstance(text, Size):
        return text
    try:
        return parse_size(text)
    except InputError as error:
        raise typer.BadParameter(str(error)) from None


def scene_names(start: str) -> list[str]:
    """Return the scenes whose names start with `start`; without any, shells complete files."""
    from nearfar.scenes import SCENES

    return [name for name in SCENES if name.startswith(start)]


def keep_input(output: Path, *inputs: Path) -> None:
    """Refuse an output that is an input of the same command, which --force would replace.

    Raises
    ------
    InputError
    """
    if realpath(output) in map(realpath, inputs):
        raise InputError(
            f"{output} is an input of this command and is kept: choose another name for the output."
        )


def keep_apart(outputs: Sequence[Path]) -> None:
    """Refuse two outputs of one name, of which the later would replace the earlier.

    Raises
    ------
    InputError
    """
    for number, output in enumerate(outputs):
        if realpath(output) in map(realpath, outputs[:number]):
            raise InputError(
                f"{output} is named for two outputs of this command: give each a name of its own."
            )


def check_report_page(page: Path, *others: Path, force: bool) -> None:
    """Check, before any work, that a page can be written and is no other file of the command.

    Raises
    ------
    InputError
        If its name does not end in .html, or it is an input or another output.
    NearfarError
        As `nearfar.files.check_output`.
    """
    from nearfar.files import check_output

    if page.suffix.lower() not in {".html", ".htm"}:
        raise InputError(f"{page} does not end in .html: choose a name that does.")
    keep_input(page, *others)
    check_output(page, force=force)


def require_reconstructed(path: Path) -> None:
    """Refuse what must be photographed or reconstructed first, and name the next command.

    Raises
    ------
    UnreadableFileError
    """
    from nearfar.files import kind_of_store

    kind, here = kind_of_store(path), quote(str(path))
    found = None
    if kind in {"nearfar exact transport", "nearfar exact operator"}:
        found = f"{path} is a scene's exact transport, not one that was reconstructed"
    elif path.is_file() and _holds_arrays(path):
        found = (
            f"{path} holds arrays, such as a measured T, and no transport that was reconstructed"
        )
    if found is not None:
        raise UnreadableFileError(
            f"{found}: photograph it by 'nearfar acquire PLAN.json CAPTURE.zarr --rig {here}', "
            f"then run 'nearfar reconstruct CAPTURE.zarr TRANSPORT.zarr'."
        )
    if kind == "nearfar capture":
        raise UnreadableFileError(
            f"{path} is a capture, of which no transport is made yet: run 'nearfar reconstruct "
            f"{here} TRANSPORT.zarr'."
        )


def _holds_arrays(path: Path) -> bool:
    """Return whether a file's name is that of a dense T."""
    from nearfar.transport.exact_store import DENSE_ENDINGS

    return path.suffix.lower() in DENSE_ENDINGS


def only_report(report: Path | None, old: Path | None, name: str) -> Path | None:
    """Return the page of --report, or of an option that was called otherwise, with a warning."""
    if old is None:
        return report
    if report is not None:
        raise typer.BadParameter("is the old name of --report: give one.", param_hint=name)
    warn(f"{name} will be removed in the next release: write the page with --report.")
    return old


def both_ranges_left_out(*, no_near: bool, no_far: bool) -> bool:
    """Return whether neither range is modelled, and refuse one range alone."""
    if no_near != no_far:
        raise typer.BadParameter(
            "goes with the other of --no-near and --no-far: with one range in the model, the joint "
            "estimate finds by itself how little the other one holds.",
            param_hint="--no-near" if no_near else "--no-far",
        )
    return no_near


NoNear = Annotated[
    bool,
    typer.Option("--no-near", help="Lamps without neighbours: no near range. With --no-far."),
]
NoFar = Annotated[
    bool,
    typer.Option("--no-far", help="No far range either: each lamp is a number of its own."),
]
Quiet = Annotated[
    bool, typer.Option("--quiet", "-q", help="Print nothing but errors and warnings.")
]
Force = Annotated[bool, typer.Option("--force", help="Replace an output that is there already.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON, and nothing else, on stdout.")]
PlanFile = Annotated[Path, typer.Argument(metavar="PLAN.json", help="Plan to follow.")]
CapturePath = Annotated[Path, typer.Argument(metavar="CAPTURE.zarr", help="Photos of a plan.")]
NewCapture = Annotated[Path, typer.Argument(metavar="CAPTURE.zarr", help="Capture to make.")]
ReportPath = Annotated[
    Path | None,
    typer.Option("--report", help="Write a page of pictures and maps too.", metavar="REPORT.html"),
]
OldReportPath = Annotated[Path | None, typer.Option("--html", hidden=True)]
DenseProjector = Annotated[
    Size | None,
    typer.Option(
        "--projector",
        parser=size,
        metavar="HxW",
        help="Pattern grid of a dense T whose file does not tell it.",
    ),
]
DenseCamera = Annotated[
    Size | None,
    typer.Option(
        "--camera",
        parser=size,
        metavar="HxW",
        help="Camera of a dense T whose file does not tell it.",
    ),
]
Port = Annotated[
    int, typer.Option(help="Port to serve on, 0 for any that is free.", min=0, max=65535)
]
Browser = Annotated[
    bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")
]
TransportPath = Annotated[Path, typer.Argument(metavar="TRANSPORT.zarr", help="Transport.")]
ScenesProjector = Annotated[
    Size | None,
    typer.Option(
        "--projector",
        parser=size,
        metavar="HxW",
        help="Pattern grid; the scene's own if left out.",
    ),
]
ScenesCamera = Annotated[
    Size | None,
    typer.Option(
        "--camera", parser=size, metavar="HxW", help="Photo; the scene's own if left out."
    ),
]
RigFile = Annotated[Path, typer.Argument(metavar="RIG.toml", help="Rig, projector and camera.")]
