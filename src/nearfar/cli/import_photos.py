"""``nearfar import``."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nearfar.cli.options import Force, NewCapture, PlanFile, Quiet, keep_input
from nearfar.cli.saying import say, say_captured
from nearfar.progress import progress_bar

if TYPE_CHECKING:
    pass


def import_photos(
    plan_file: PlanFile,
    photos: Annotated[Path, typer.Argument(metavar="PHOTOS_DIR", help="Folder of the photos.")],
    output: NewCapture,
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
    """
    from nearfar.capture import import_photos as bring_in
    from nearfar.capture import pair
    from nearfar.files import check_output
    from nearfar.plan import read_plan

    made = read_plan(plan_file)
    keep_input(output, plan_file, photos)
    check_output(output, force=force)
    paths = pair(made, photos, list_file)
    with progress_bar("photos", quiet=quiet) as report:
        summary = bring_in(
            made,
            paths,
            output,
            full_scale=full_scale,
            force=force,
            progress=report,
        )
    say(f"first: {summary.first}\nlast: {summary.last}", quiet=quiet)
    say_captured(summary.capture, output, quiet=quiet)
