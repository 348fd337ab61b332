"""How errors and interrupts of a command reach people: a sentence, and an exit status."""

import errno
import os
import signal
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, NoReturn

import typer

from nearfar.cli.flags import with_flags
from nearfar.cli.interrupted import NOTHING_LEFT
from nearfar.cli.printable import printable
from nearfar.cli.saying import warn
from nearfar.cli.stopping import handled_by
from nearfar.errors import KeptInterrupt, NearfarError

# Modules whose callbacks are called as objects are deleted.
WEAK_REFERENCES = ("_weakrefset", "weakref")
# Seconds after which a signal to stop is raised that would have been ignored.
LATER = 0.01
# Signals to stop that arrived while the command ran.
_stops: list[int] = []


@contextmanager
def faults_in_sentences() -> Iterator[None]:
    """Turn whatever stops a command into a sentence on stderr and an exit status."""
    try:
        yield
        # At exit it would be too late to report that the output could not be written.
        sys.stdout.flush()
    except NearfarError as error:
        _fail(with_flags(str(error)))
    except KeyboardInterrupt as stopped:
        _interrupted(stopped)
    except BrokenPipeError:
        # Whoever read our output has gone; the interpreter must not complain of it at exit.
        _discard_stdout()
        sys.exit(1)
    except MemoryError as error:
        reason = f" ({error})" if str(error) else ""
        _fail(f"there is not enough memory{reason}: choose smaller sizes.")
    except (typer.Exit, typer.BadParameter):
        raise
    except OSError as error:
        fault = error.strerror or str(error)
        if error.filename is None:
            # Errors of files name the file, but for those of a disk that cannot be read.
            if error.errno == errno.EIO:
                _fail(f"a file could not be read or written ({fault}): check the disks.")
            _discard_stdout()
            _fail(f"stdout could not be written ({fault}): send it elsewhere.")
        _fail(
            f"{error.filename} could not be used ({fault}): check that it is there and may be read."
        )
    except Exception as error:  # A fault of our own still owes the user a sentence.
        if _stops:
            # A library that is interrupted while it loads raises an error of its own.
            _interrupted()
        if os.environ.get("NEARFAR_TRACEBACK"):
            raise
        what = " ".join(f"{type(error).__name__}: {error}".split())
        _fail(
            f"the program met a fault of its own ({what}): run again with NEARFAR_TRACEBACK=1 and "
            f"report what it prints."
        )


@contextmanager
def warnings_in_lines() -> Iterator[None]:
    """Print Python's warnings as those of a command: a line each, without the place in the code."""

    def show(message: Warning | str, *_where: Any, **_more: Any) -> None:
        warn(str(message))

    with warnings.catch_warnings():
        warnings.showwarning = show
        yield


@contextmanager
def stopped_cleanly() -> Iterator[None]:
    """Raise KeyboardInterrupt on signals to stop, for the command to remove half-written files.

    Where Python would ignore it, a little later.
    """

    def stop(number: int, frame: FrameType | None) -> None:
        _stops.append(number)
        raise_or_wait(frame)

    def raise_or_wait(frame: FrameType | None) -> None:
        is_ignored = _is_ignored_in(frame)
        # One signal after another is raised once, and not again while files are removed.
        signal.setitimer(signal.ITIMER_REAL, LATER if is_ignored else 0)
        if not is_ignored:
            raise KeyboardInterrupt

    _stops.clear()
    usual = signal.signal(signal.SIGALRM, lambda _, frame: raise_or_wait(frame))
    try:
        with handled_by(stop):
            yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, usual)


def _is_ignored_in(frame: FrameType | None) -> bool:
    """Return whether Python ignores what is raised, as it does while objects are deleted."""
    while frame is not None:
        module = frame.f_globals.get("__name__")
        if frame.f_code.co_name == "__del__" or module in WEAK_REFERENCES:
            return True
        frame = frame.f_back
    return False


def _interrupted(stopped: KeyboardInterrupt | None = None) -> NoReturn:
    status = 128 + (_stops[-1] if _stops else signal.SIGINT)
    kept = isinstance(stopped, KeptInterrupt)
    _fail(with_flags(str(stopped)) if kept else NOTHING_LEFT, status=status)


def _discard_stdout() -> None:
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _fail(sentence: str, *, status: int = 1) -> NoReturn:
    print(f"nearfar: {printable(sentence)}", file=sys.stderr)
    sys.exit(status)
