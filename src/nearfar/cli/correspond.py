"""``nearfar correspond``."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from nearfar.arrays import Size
from nearfar.cli.options import CapturePath, Force, Quiet, keep_input, size
from nearfar.cli.saying import say, warn
from nearfar.progress import progress_bar


def correspond(
    capture_path: CapturePath,
    output: Annotated[
        Path,
        typer.Argument(
            metavar="Q.npy", help="Array to write: (y, x) of each camera pixel, NaN where unlit."
        ),
    ],
    confidence: Annotated[
        Path | None,
        typer.Option(help="Write how sure each is too, from 0 to 1.", metavar="C.npy"),
    ] = None,
    projector: Annotated[
        Size | None,
        typer.Option(
            parser=size,
            metavar="HxW",
            help="Count q in pixels of this pattern grid instead, such as that of the capture "
            "whose transport is to be reconstructed.",
        ),
    ] = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Find which projector pixel lights each camera pixel, from photos of any patterns.

    Example: nearfar correspond codes.zarr q.npy
    """
    from nearfar.capture import open_capture
    from nearfar.files import check_output, write_array
    from nearfar.workflow.by_codes import correspond_by_codes, on_grid
    from nearfar.workflow.pattern_faults import find_pattern_faults
    from nearfar.workflow.steps import correspond as by_plan

    capture = open_capture(capture_path)
    for path in (output, *([confidence] if confidence is not None else [])):
        if path.suffix.lower() != ".npy":
            raise typer.BadParameter(f"{path} does not end in .npy: choose a name that does.")
        keep_input(path, capture_path)
        check_output(path, force=force)
    if confidence is not None:
        keep_input(confidence, output)
    with progress_bar("correspondence", quiet=quiet) as report:
        if capture.plan.offset == "shown":
            by_codes = correspond_by_codes(capture, report)
            found = by_codes.correspondence
            warnings = by_codes.warnings() + find_pattern_faults(capture, found.q)
        else:
            found, warnings = by_plan(capture, progress=report), []
    for sentence in warnings:
        warn(sentence)
    grid = capture.plan.projector if projector is None else projector
    q = on_grid(found.q, capture.plan.projector, grid)
    write_array(output, q, force=force)
    if confidence is not None:
        write_array(confidence, found.confidence, force=force)
    lit = np.isfinite(q).any(axis=-1).mean()
    say(
        f"q of {lit:.1%} of {capture.camera} camera pixels, in pixels of a projector of {grid}, "
        f"written to {output}",
        quiet=quiet,
    )
