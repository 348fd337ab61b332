"""``nearfar acquire`` and ``nearfar import``."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nearfar.cli.options import Force, PlanFile, Quiet, keep_input
from nearfar.cli.progress import SATURATED, counted, progress_bar, say, warn

if TYPE_CHECKING:
    from nearfar.capture import Capture

NewCapture = Annotated[Path, typer.Argument(metavar="CAPTURE.zarr", help="Capture to make.")]


def acquire(
    plan_file: PlanFile,
    output: NewCapture,
    rig: Annotated[
        str,
        typer.Option(
            help="Scene (cornell, cornell-aside, wedge, corner, alcove, shelf), Mitsuba 3 scene "
            "(.xml), stored transport (.npy, .npz, Zarr), or RIG.toml.",
            metavar="RIG",
        ),
    ],
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Shoot a plan on a simulated rig.

    Example: nearfar acquire plan.json capture.zarr --rig cornell
    """
    from nearfar.files import check_output
    from nearfar.plan import read_plan
    from nearfar.rigs.config import notes_of, open_rig
    from nearfar.workflow.acquire import acquire as shoot

    made = read_plan(plan_file)
    made.require_real("shoot")
    keep_input(output, plan_file, Path(rig))
    check_output(output, force=force)
    with progress_bar("opening the rig", quiet=quiet) as report:
        opened = open_rig(rig, made.projector, progress=report)
        for note in notes_of(opened):
            warn(note)
        taken = shoot(
            made,
            output,
            opened,
            force=force,
            progress=counted(report, "photos", len(made.patterns)),
        )
    if opened.exposure != 1.0:
        say(f"transport of {opened.name} exposed by {opened.exposure:.6g}", quiet=quiet)
    _conclude(taken, output, quiet=quiet)


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
        typer.Option(help="Value of full scale, such as 16383 for 14 bits.", metavar="VALUE"),
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
            progress=counted(report, "photos", len(paths)),
        )
    say(f"first: {summary.first}\nlast: {summary.last}", quiet=quiet)
    _conclude(summary.capture, output, quiet=quiet)


def _conclude(taken: "Capture", output: Path, *, quiet: bool) -> None:
    share = taken.saturated_share
    if share > SATURATED:
        warn(
            f"{share:.2%} of the values in {output} are saturated: expose less, or their camera "
            f"pixels will be wrong."
        )
    say(
        f"{len(taken.plan.patterns)} photos of {taken.camera} with {taken.channels} "
        f"channel{'s' if taken.channels > 1 else ''} written to {output}",
        quiet=quiet,
    )
