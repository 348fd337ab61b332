"""``nearfar info``."""

from pathlib import Path
from typing import Annotated

import typer

from nearfar.cli.flags import with_flags
from nearfar.cli.options import Quiet, require_reconstructed
from nearfar.cli.saying import say
from nearfar.progress import progress_bar


def info(
    path: Annotated[
        Path,
        typer.Argument(
            metavar="FILE",
            help="Plan, capture, transport, array, picture, RIG.toml, Mitsuba scene or folder.",
        ),
    ],
    capture: Annotated[
        Path | None,
        typer.Option(
            help="Capture that the transport FILE was reconstructed from: judge the transport by "
            "it first, and keep the verdict in FILE.",
            metavar="CAPTURE.zarr",
        ),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Describe what a file holds; of a transport, first whether it can be trusted.

    Example: nearfar info capture.zarr
    """
    from nearfar.report.contents import describe

    if capture is not None:
        from nearfar.capture import open_capture
        from nearfar.workflow.verdict.keeping import judge_transport

        require_reconstructed(path)
        with progress_bar("judging", quiet=quiet) as progress:
            judge_transport(path, open_capture(capture), progress=progress)
    # Alarms that a capture keeps, and what is said of a verdict, speak to Python.
    say(with_flags(describe(path)), quiet=quiet)
