"""The command ``nearfar``: its commands, and how faults reach people.

Command modules import at their top what the help needs; what a command computes with loads when it
runs, so that help and ``nearfar plan`` come at once.
"""

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Annotated, NoReturn

import typer

from nearfar.cli import (
    acquiring,
    checking,
    comparing,
    demonstration,
    figuring,
    informing,
    looking,
    planning,
    reconstructing,
    rigging,
    separating,
    transports,
    viewing,
)
from nearfar.errors import KeptInterrupt, NearfarError

app = typer.Typer(
    name="nearfar",
    help="Measure how light travels between a projector and a camera, and relight the scene.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=True,
    rich_markup_mode=None,
)

COMMANDS: dict[str, Callable[..., None]] = {
    "demo": demonstration.demo,
    "plan": planning.plan,
    "export": planning.export,
    "acquire": acquiring.acquire,
    "import": acquiring.import_photos,
    "reconstruct": reconstructing.reconstruct,
    "relight": transports.relight,
    "evaluate": looking.evaluate,
    "render": looking.render,
    "info": informing.info,
    "convert": transports.convert,
    "check": checking.check,
    "compare": comparing.compare,
    "figures": figuring.figures,
    "separate": separating.separate,
    "devices": rigging.devices,
    "init": rigging.init,
    "preview": rigging.preview,
    "calibrate": rigging.calibrate,
    "view": viewing.view,
}

STOPS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

# Signals to stop that came while a command ran.
_stops: list[int] = []


def _print_version(wanted: bool) -> None:
    if wanted:
        from nearfar.version import version

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


@contextmanager
def _faults_in_sentences() -> Iterator[None]:
    """Turn whatever stops a command into a sentence on stderr and an exit status."""
    try:
        yield
        # At exit it would be too late to say that a disk or a pipe took nothing.
        sys.stdout.flush()
    except NearfarError as error:
        _fail(str(error))
    except KeyboardInterrupt as stopped:
        _interrupted(stopped)
    except BrokenPipeError:
        # Whoever read our output has gone; the interpreter must not complain at exit.
        _discard_stdout()
        sys.exit(1)
    except MemoryError as error:
        _fail(f"there is not enough memory ({error}): choose smaller sizes.")
    except (typer.Exit, typer.BadParameter):
        raise
    except OSError as error:
        if error.filename is None:
            # Files have names; faults of writing them are sentences already.
            _discard_stdout()
            _fail(f"stdout could not be written ({error.strerror or error}): send it elsewhere.")
        _fail(
            f"{error.filename} could not be used ({error.strerror}): check that it is there and "
            f"may be read."
        )
    except Exception as error:  # A fault of our own still owes the user a sentence.
        if _stops:
            # A library interrupted while it loads says so in words of its own.
            _interrupted()
        if os.environ.get("NEARFAR_TRACEBACK"):
            raise
        what = " ".join(f"{type(error).__name__}: {error}".split())
        _fail(
            f"the program met a fault of its own ({what}): run again with NEARFAR_TRACEBACK=1 and "
            f"report what it prints."
        )


for _name, _command in COMMANDS.items():
    # Inside the command, before the parser gives interrupts and faults words of its own.
    app.command(_name)(_faults_in_sentences()(_command))


def main() -> None:
    """Run the command line; every fault is one sentence on stderr and exit status 1."""
    with _stopped_cleanly(), _faults_in_sentences():
        try:
            app()
        finally:
            sys.stdout.flush()


@contextmanager
def _stopped_cleanly() -> Iterator[None]:
    """Let a command that is told to end remove what it has half-written."""

    def stop(number: int, _frame: FrameType | None) -> NoReturn:
        _stops.append(number)
        raise KeyboardInterrupt

    usual = (signal.SIG_DFL, signal.default_int_handler)
    # What is ignored, as under nohup, stays ignored.
    replaced = {n: signal.getsignal(n) for n in STOPS if signal.getsignal(n) in usual}
    _stops.clear()
    for number in replaced:
        signal.signal(number, stop)
    try:
        yield
    finally:
        for number, handler in replaced.items():
            signal.signal(number, handler)


def _interrupted(stopped: KeyboardInterrupt | None = None) -> NoReturn:
    status = 128 + (_stops[-1] if _stops else signal.SIGINT)
    what = "interrupted: nothing half-written was left behind."
    _fail(str(stopped) if isinstance(stopped, KeptInterrupt) else what, status=status)


def _discard_stdout() -> None:
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _fail(sentence: str, *, status: int = 1) -> NoReturn:
    print(f"nearfar: {sentence}", file=sys.stderr)
    sys.exit(status)
