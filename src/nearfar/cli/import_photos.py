"""``nearfar import``."""

from pathlib import Path
from typing import Annotated

import typer

from nearfar.cli.options import Force, Quiet, keep_input
from nearfar.cli.saying import say, say_captured
from nearfar.progress import progress_bar


def import_photos(
    paths: Annotated[
        list[Path],
        typer.Argument(
            metavar="[PLAN.json] PHOTOS_DIR CAPTURE.zarr",
            help="Plan that was shot, folder of the photos, capture to make; with --patterns, no "
            "plan.",
        ),
    ],
    patterns: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the pictures that were shown, one for each photo, in place of a plan: "
            "Gray code, fringes, Hadamard, single pixels, random ones, or any others.",
            metavar="PATTERNS_DIR",
        ),
    ] = None,
    list_file: Annotated[
        Path | None,
        typer.Option("--list", help="Text file that names the photos in order.", metavar="FILE"),
    ] = None,
    full_scale: Annotated[
        float | None,
        typer.Option(
            help="Value of the photos at full scale, such as 16383 for 14 bits.", metavar="VALUE"
        ),
    ] = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Bring in photos taken elsewhere, one per pattern, in natural order of their names.

    Example: nearfar import plan.json photos capture.zarr --full-scale 16383

    Example: nearfar import --patterns patterns photos capture.zarr
    """
    from nearfar.capture import import_photos as bring_in
    from nearfar.capture import pair, read_shown
    from nearfar.files import check_output
    from nearfar.plan import read_plan
    from nearfar.plan.recognition import summarise

    source, photos, output = _three(paths, patterns)
    keep_input(output, source, photos)
    shown = None
    if patterns is None:
        made = read_plan(source)
        check_output(output, force=force)
        named = pair(made, photos, list_file)
    else:
        check_output(output, force=force)
        with progress_bar("patterns", quiet=quiet) as report:
            shown = read_shown(patterns, report)
        made = shown.plan
        named = pair(made, photos, list_file, source=str(patterns))
    with progress_bar("photos", quiet=quiet) as report:
        summary = bring_in(
            made,
            named,
            output,
            full_scale=full_scale,
            shown=shown,
            force=force,
            progress=report,
        )
    if shown is not None:
        say("\n".join(["recognised:", *summarise(shown.recognised)]), quiet=quiet)
    say(f"first: {summary.first}\nlast: {summary.last}", quiet=quiet)
    say_captured(summary.capture, output, quiet=quiet)


def _three(paths: list[Path], patterns: Path | None) -> tuple[Path, Path, Path]:
    """Return the plan or the folder of patterns, the folder of photos, and the capture to make."""
    if patterns is not None:
        paths = [patterns, *paths]
    if len(paths) != 3:
        needed = (
            "PHOTOS_DIR and CAPTURE.zarr" if patterns else "PLAN.json, PHOTOS_DIR, CAPTURE.zarr"
        )
        named = len(paths) - (patterns is not None)
        raise typer.BadParameter(f"{needed} are needed, {named} were given.")
    return paths[0], paths[1], paths[2]
