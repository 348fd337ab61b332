"""``nearfar export``."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nearfar.arrays import Size
from nearfar.cli.options import Force, PlanFile, Quiet, size
from nearfar.cli.saying import say
from nearfar.progress import progress_bar

if TYPE_CHECKING:
    pass


def export(
    plan_file: PlanFile,
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder to make.")],
    scale: Annotated[
        int | None,
        typer.Option(min=1, help="Show each pattern pixel as N x N pixels.", metavar="N"),
    ] = None,
    native: Annotated[
        Size | None,
        typer.Option(
            parser=size,
            metavar="HxW",
            help="Centre the pattern on a black frame of this size, as large as fits or as "
            "--scale says.",
        ),
    ] = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Write a plan's patterns as 8-bit grey PNG, one per photo in the order to shoot.

    Example: nearfar export plan.json patterns --native 1080x1920
    """
    from nearfar.plan import read_plan
    from nearfar.workflow.export import export_patterns

    made = read_plan(plan_file)
    with progress_bar("patterns", quiet=quiet) as report:
        layout = export_patterns(
            made,
            folder,
            scale=scale,
            native=native,
            force=force,
            progress=report,
        )
    say(
        f"{len(made.patterns)} patterns of {layout.frame} written to {folder}, a pattern pixel as "
        f"{layout.scale} x {layout.scale}",
        quiet=quiet,
    )
