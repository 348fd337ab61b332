"""What a command says while it works: on stderr, on a terminal only, after a moment."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Timer
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import TaskID

# Seconds; a job that ends sooner shows no bar.
PATIENCE = 1.0

# A share of saturated values above this is worth a warning.
SATURATED = 1e-4

Report = Callable[[str, float], None]


@contextmanager
def progress_bar(what: str, *, quiet: bool) -> Iterator[Report]:
    """Yield a function to tell what is being done and the share done, 0 to 1.

    Parameters
    ----------
    what : str
        What is being done until the job itself tells.
    quiet : bool
        Show nothing.
    """
    if quiet or not sys.stderr.isatty():
        yield lambda _what, _share: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    bars = Progress(
        TextColumn("{task.description:>24}"),
        BarColumn(),
        TimeRemainingColumn(),
        console=Console(stderr=True),
    )
    unknown = bars.add_task(what, total=None)
    tasks: dict[str, TaskID] = {}

    def report(what: str, share: float) -> None:
        if what not in tasks:
            bars.update(unknown, visible=False)
            tasks[what] = bars.add_task(what, total=1.0)
        bars.update(tasks[what], completed=share)

    # A clock of its own: a job whose first step is long tells nothing meanwhile.
    clock = Timer(PATIENCE, bars.start)
    clock.daemon = True
    clock.start()
    try:
        yield report
    finally:
        clock.cancel()
        clock.join()
        if bars.live.is_started:
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
