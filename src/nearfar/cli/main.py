"""The command ``nearfar``: its commands, and how faults reach people."""

import os
import sys
from typing import Annotated

import typer

from nearfar.cli import acquiring, demonstration, looking, planning, transports
from nearfar.errors import NearfarError
from nearfar.version import version

app = typer.Typer(
    name="nearfar",
    help="Measure how light travels between a projector and a camera, and relight the scene.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
    rich_markup_mode=None,
)


def _print_version(wanted: bool) -> None:
    if wanted:
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


app.command("demo")(demonstration.demo)
app.command("plan")(planning.plan)
app.command("export")(planning.export)
app.command("acquire")(acquiring.acquire)
app.command("import")(acquiring.import_photos)
app.command("reconstruct")(transports.reconstruct)
app.command("relight")(transports.relight)
app.command("evaluate")(looking.evaluate)
app.command("render")(looking.render)
app.command("info")(looking.info)
app.command("convert")(transports.convert)


def main() -> None:
    """Run the command line; every fault is one sentence on stderr and exit status 1."""
    try:
        app()
    except NearfarError as error:
        _fail(str(error))
    except KeyboardInterrupt:
        _fail("interrupted: nothing half-written was left behind.", status=130)
    except BrokenPipeError:
        # Whoever read our output has gone; the interpreter must not complain at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except MemoryError as error:
        _fail(f"there is not enough memory ({error}): use a smaller camera or pattern grid.")
    except Exception as error:  # A fault of our own still owes the user a sentence.
        if os.environ.get("NEARFAR_TRACEBACK"):
            raise
        _fail(
            f"nearfar met a fault of its own ({type(error).__name__}: {error}): run again with "
            f"NEARFAR_TRACEBACK=1 and report what it prints."
        )


def _fail(sentence: str, *, status: int = 1) -> None:
    print(f"nearfar: {sentence}", file=sys.stderr)
    sys.exit(status)
