"""What a command says while it works: on stderr, on a terminal only, after a moment."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

# A job that ends sooner shows no bar.
PATIENCE = 1.0

Report = Callable[[str, float], None]


@contextmanager
def progress_bar(*, quiet: bool) -> Iterator[Report]:
    """Yield a function to tell what is being done and the share done, 0 to 1."""
    console = Console(stderr=True)
    if quiet or not console.is_terminal:
        yield lambda _what, _share: None
        return
    bars = Progress(
        TextColumn("{task.description:>24}"), BarColumn(), TimeRemainingColumn(), console=console
    )
    tasks: dict[str, TaskID] = {}
    started = time.monotonic()

    def report(what: str, share: float) -> None:
        if not tasks and time.monotonic() - started < PATIENCE and share < 1.0:
            return
        if what not in tasks:
            bars.start()
            tasks[what] = bars.add_task(what, total=1.0)
        bars.update(tasks[what], completed=share)

    try:
        yield report
    finally:
        bars.stop()


def counted(report: Report, what: str, total: int) -> Callable[[int], None]:
    """Turn a report of shares into one of counts."""
    return lambda done: report(what, done / max(1, total))


def say(text: str, *, quiet: bool = False) -> None:
    """Print a line for people on stdout."""
    if not quiet:
        print(text)


def warn(text: str) -> None:
    """Print a warning on stderr."""
    print(f"warning: {text}", file=sys.stderr)
