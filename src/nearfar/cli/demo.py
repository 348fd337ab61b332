"""``nearfar demo``."""

from pathlib import Path
from typing import Annotated

import typer

from nearfar.cli.command_line import command_line
from nearfar.cli.options import Force, Quiet
from nearfar.cli.saying import say
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
        f"SNR_b {found['snr_b_pictures']:.1f} dB under pictures (mean of five), "
        f"{found['snr_b']['white']:.1f} dB under white; SNR_t {found['snr_t']['p50']:.1f} dB "
        f"(median)\nopen {output / 'report.html'}",
        quiet=quiet,
    )
