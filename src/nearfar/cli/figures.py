"""``nearfar figures``."""

from pathlib import Path
from typing import Annotated

import typer

from nearfar.cli.command_line import command_line
from nearfar.cli.options import Force, Quiet
from nearfar.cli.saying import say, warn
from nearfar.progress import progress_bar


def figures(
    output: Annotated[Path, typer.Argument(metavar="OUT", help="Folder to make.")],
    only: Annotated[
        list[str] | None,
        typer.Option(help="A figure to draw, 1 to 6, or table; may be repeated.", metavar="NAME"),
    ] = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Draw the paper's figures and its table; OUT/index.html shows them.

    The first run computes scenes and takes some minutes; what was measured is kept for the next.

    Example: nearfar figures paper-figures --only 5
    """
    from nearfar.files import check_output
    from nearfar.report.figures.run import INDEX, check_names, is_figures, make_figures

    names = check_names(only or [])
    check_output(output, force=force, replaceable=is_figures)
    with progress_bar("figures", quiet=quiet) as report:
        make_figures(output, names, force=force, progress=report, note=warn, command=command_line())
    say(f"{', '.join(names)} drawn; open {output / INDEX}", quiet=quiet)
