"""``nearfar check``."""

import json
from pathlib import Path
from typing import Annotated

import typer

from nearfar.arrays import Size
from nearfar.cli.command_line import command_line
from nearfar.cli.options import (
    AsJson,
    DenseCamera,
    DenseProjector,
    Force,
    OldReportPath,
    Quiet,
    ReportPath,
    check_report_page,
    only_report,
    size,
)
from nearfar.cli.saying import say
from nearfar.progress import progress_bar


def check(
    transport: Annotated[
        Path,
        typer.Argument(
            metavar="TRANSPORT",
            help="What render or reconstruct wrote, or a dense T of any origin (.npy, .npz, Zarr).",
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
    projector: DenseProjector = None,
    camera: DenseCamera = None,
    report: ReportPath = None,
    html: OldReportPath = None,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Check where the paper's assumptions hold on a scene, and where they do not.

    The last line is the verdict: good, doubtful or wrong, and why.

    Example: nearfar check truth.zarr --near 19 --far 13x13 --report check.html
    """
    from nearfar.report.model_check import check_page, check_rows
    from nearfar.report.page import write_page
    from nearfar.rigs.simulated.opening import load_world
    from nearfar.workflow.check import check_model, dropped_of
    from nearfar.workflow.conditioning import condition_near
    from nearfar.workflow.verdict.model_check import describe_verdict, judge_check, numbers_of

    page = only_report(report, html, "--html")
    if page is not None:
        check_report_page(page, transport, force=force)
    with progress_bar("checking", quiet=quiet) as told:
        world = load_world(transport, projector, camera)
        dropped = dropped_of(world.projector, near, far, drop)
        # Pages have maps of every camera pixel.
        sample = None if page is None else world.camera.pixels
        found = check_model(world, near, far, sample=sample, progress=told)
        condition = condition_near(world.projector, near, dropped)
        if page is not None:
            text = check_page(transport.name, found, condition, world.camera, command_line())
            write_page(page, text, force=force)
    numbers = numbers_of(found, condition)
    if as_json:
        print(json.dumps(numbers, allow_nan=False))
        return
    for what, assumed, measured in check_rows(numbers):
        say(f"{what}: {measured}" + (f" (assumed: {assumed})" if assumed else ""), quiet=quiet)
    say(describe_verdict(judge_check(found)), quiet=quiet)
