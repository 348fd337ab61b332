"""``nearfar demo``."""

from pathlib import Path
from typing import Annotated

import typer

from nearfar.cli.command_line import command_line
from nearfar.cli.options import Force, Quiet
from nearfar.cli.saying import say
from nearfar.decibels import in_words
from nearfar.progress import progress_bar


def demo(
    output: Annotated[Path, typer.Argument(metavar="[OUT]", help="Folder to make.")] = Path(
        "nearfar-demo"
    ),
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Run the whole job on the built-in scene; OUT/report.html shows it.

    Example: nearfar demo
    """
    from nearfar.files import check_output
    from nearfar.report.demo import is_demo, run_demo

    check_output(output, force=force, replaceable=is_demo)
    with progress_bar("demo", quiet=quiet) as report:
        found = run_demo(output, force=force, progress=report, command=command_line())
    say(
        f"SNR_b {in_words(found['snr_b_pictures'])} under pictures (mean of five), "
        f"{in_words(found['snr_b']['white'])} under white; SNR_t {in_words(found['snr_t']['p50'])} "
        f"(median)\nopen {output / 'report.html'}",
        quiet=quiet,
    )
