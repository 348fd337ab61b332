"""``nearfar check``."""

import json
from pathlib import Path
from typing import Annotated

import typer

from nearfar.arrays import Size
from nearfar.cli.options import AsJson, Force, Quiet, check_report_page, size
from nearfar.cli.saying import say
from nearfar.progress import progress_bar


def check(
    transport: Annotated[
        Path,
        typer.Argument(
            metavar="TRANSPORT", help="What render or reconstruct wrote, with its components apart."
        ),
    ],
    near: Annotated[int, typer.Option(min=1, help="W of the near-range window.", metavar="W")],
    far: Annotated[
        Size, typer.Option(parser=size, metavar="HxW", help="Far band, height x width.")
    ],
    drop: Annotated[
        Size | None,
        typer.Option(parser=size, metavar="HxW", help="Near frequencies left out; as in plan."),
    ] = None,
    page: Annotated[
        Path | None,
        typer.Option("--html", help="Write a page with maps to this file.", metavar="FILE.html"),
    ] = None,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Check where the paper's assumptions hold on a scene, and where they do not.

    Example: nearfar check truth.zarr --near 19 --far 13x13 --html check.html
    """
    from nearfar.files import new_output
    from nearfar.plan import paper_plan
    from nearfar.report.model_check import check_page, check_rows
    from nearfar.rigs.simulated.opening import load_world
    from nearfar.workflow.check import DEFAULT_SAMPLE, check_model, numbers_of
    from nearfar.workflow.conditioning import condition_near

    if page is not None:
        check_report_page(page, transport, force=force)
    with progress_bar("checking", quiet=quiet) as report:
        world = load_world(transport, None, None)
        plan = paper_plan(world.projector, near, far, dropped=drop, correspondence="none")
        sample = DEFAULT_SAMPLE if page is None else world.camera.pixels
        found = check_model(world, near, far, sample=sample, progress=report)
        condition = condition_near(world.projector, near, plan.dropped)
        if page is not None:
            with new_output(page, force=force) as partial:
                text = check_page(transport.name, found, condition, world.camera)
                partial.write_text(text, encoding="utf-8")
    if as_json:
        print(json.dumps(numbers_of(found, condition), allow_nan=False))
        return
    for what, assumed, measured in check_rows(numbers_of(found, condition)):
        say(f"{what}: {measured}" + (f" (assumed: {assumed})" if assumed else ""), quiet=quiet)
