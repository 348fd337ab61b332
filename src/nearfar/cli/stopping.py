"""Signals to stop a command.

Importing the modules of a command takes a good part of its time. Until they are imported the
command has begun nothing, and some of them, as Typer, would end it with a message of their own or
with none.
"""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from nearfar.cli.interrupted import end

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def stopped_at_once() -> Iterator[None]:
    """Exit at once, with a line that says so, on a signal to stop."""
    with handled_by(_end):
        yield


@contextmanager
def handled_by(handle: Callable[[int, FrameType | None], object]) -> Iterator[None]:
    """Handle signals to stop; those that are ignored, as under nohup, stay ignored."""
    usual = (signal.SIG_DFL, signal.default_int_handler, _end)
    replaced = {n: signal.getsignal(n) for n in STOP_SIGNALS if signal.getsignal(n) in usual}
    for number in replaced:
        signal.signal(number, handle)
    try:
        yield
    finally:
        for number, handler in replaced.items():
            signal.signal(number, handler)


def _end(number: int, _frame: FrameType | None) -> None:
    end(number)
