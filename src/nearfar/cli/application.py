"""The command ``nearfar``."""

import sys
from typing import Annotated

import typer

from nearfar.cli.faults import faults_in_sentences, warnings_in_lines
from nearfar.cli.group import CommandGroup

app = typer.Typer(
    name="nearfar",
    cls=CommandGroup,
    help="Measure how light travels between a projector and a camera, and relight the scene.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=True,
    rich_markup_mode=None,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        from nearfar.release import version

        print(f"nearfar {version()}")
        raise typer.Exit()


@app.callback()
def options(
    show_version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Print version."),
    ] = False,
) -> None:
    """Measure light transport between a projector and a camera, and relight the scene."""


def main() -> None:
    """Run the command line; every fault is one sentence on stderr and exit status 1."""
    with warnings_in_lines(), faults_in_sentences():
        try:
            app()
        finally:
            sys.stdout.flush()
