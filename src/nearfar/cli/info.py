"""``nearfar info``."""

from pathlib import Path
from typing import Annotated

import typer

from nearfar.cli.flags import with_flags
from nearfar.cli.options import Quiet
from nearfar.cli.saying import say


def info(
    path: Annotated[
        Path,
        typer.Argument(
            metavar="FILE",
            help="Plan, capture, transport, array, picture, RIG.toml, Mitsuba scene or folder.",
        ),
    ],
    quiet: Quiet = False,
) -> None:
    """Describe what a file holds.

    Example: nearfar info capture.zarr
    """
    from nearfar.report.contents import describe

    # Alarms that a capture keeps speak to Python.
    say(with_flags(describe(path)), quiet=quiet)
