"""``nearfar plan`` and ``nearfar export``."""

import json
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nearfar.arrays import Size
from nearfar.cli.options import AsJson, Force, PlanFile, Quiet, size
from nearfar.cli.progress import counted, progress_bar, say

if TYPE_CHECKING:
    from nearfar.plan import Plan


class Offset(StrEnum):
    """How the offset of a sinusoid is taken out."""

    INVERSE = "inverse"
    REFERENCE = "reference"
    NONE = "none"


class CorrespondenceBy(StrEnum):
    """What is projected for correspondence."""

    STRIPES = "stripes"
    PHASE = "phase"
    NONE = "none"


def plan(
    projector: Annotated[
        Size,
        typer.Option(parser=size, metavar="HxW", help="Pattern grid, height x width in pixels."),
    ],
    near: Annotated[int, typer.Option(min=1, help="W of the near-range window.", metavar="W")],
    far: Annotated[
        Size, typer.Option(parser=size, metavar="HxW", help="Far band, height x width.")
    ],
    drop: Annotated[
        Size | None,
        typer.Option(
            parser=size,
            metavar="HxW",
            help="Lowest near frequencies to leave out, odd x odd; by default those up to k_far.",
        ),
    ] = None,
    offset: Annotated[
        Offset,
        typer.Option(
            help="Each pattern with its inverse, or once with white and black at intervals; none "
            "is for counting and simulation only."
        ),
    ] = Offset.INVERSE,
    correspondence: Annotated[
        CorrespondenceBy,
        typer.Option(help="Photos of black stripes, the patterns' own phase, or none."),
    ] = CorrespondenceBy.STRIPES,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Write the plan here.", metavar="FILE")
    ] = None,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Plan the patterns of the paper and count the photos.

    Example: nearfar plan --projector 128x128 --near 19 --far 13x13 -o plan.json
    """
    from nearfar.plan import paper_plan

    made = paper_plan(
        projector,
        near,
        far,
        dropped=drop,
        offset=offset.value,
        correspondence=correspondence.value,
    )
    if output is not None:
        from nearfar.files import new_output

        with new_output(output, force=force) as partial:
            partial.write_text(made.to_json(), encoding="utf-8")
    if as_json:
        print(json.dumps(made.summary()))
    else:
        say(describe_plan(made), quiet=quiet)
        if output is not None:
            say(f"plan written to {output}", quiet=quiet)


def describe_plan(made: "Plan") -> str:
    """Say in lines what a plan holds."""
    counts = ", ".join(f"{count} {purpose}" for purpose, count in made.counts.items() if count)
    return "\n".join(
        [
            f"projector {made.projector}, W = {made.window}, far band {made.far}, "
            f"near frequencies dropped {made.dropped}, offset {made.offset}",
            f"{len(made.patterns)} photos: {counts}",
            f"{made.transport_photos} photos of transport against {made.projector.pixels} by brute "
            f"force: {made.savings:.2f} times fewer",
        ]
    )


def export(
    plan_file: PlanFile,
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder to make.")],
    scale: Annotated[
        int | None, typer.Option(min=1, help="Show each pattern pixel as N x N.", metavar="N")
    ] = None,
    native: Annotated[
        Size | None,
        typer.Option(
            parser=size,
            metavar="HxW",
            help="Centre the pattern on a frame of this size, black around; as large as fits "
            "unless --scale says.",
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
        shown = export_patterns(
            made,
            folder,
            scale=scale,
            native=native,
            force=force,
            progress=counted(report, "patterns", len(made.patterns)),
        )
    say(
        f"{len(made.patterns)} patterns of {shown.frame} written to {folder}, a pattern pixel as "
        f"{shown.scale} x {shown.scale}",
        quiet=quiet,
    )
