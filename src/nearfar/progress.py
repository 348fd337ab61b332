"""Progress of work that takes long: a bar on a terminal and in a notebook."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from threading import Timer
from typing import TYPE_CHECKING

from nearfar.callbacks import (
    OldReport,
    Report,
    as_report,
    counted,
    counting,
    ignore_progress,
)

if TYPE_CHECKING:
    from rich.progress import TaskID

__all__ = [
    "OldReport",
    "Report",
    "as_report",
    "counted",
    "counting",
    "duration",
    "ignore_progress",
    "progress_bar",
]

# A job that ends sooner shows no bar.
SECONDS_BEFORE_A_BAR = 1.0
# A notebook redraws a bar after this share of a job: each drawing is a message to the browser.
SHARE_BETWEEN_DRAWINGS = 0.01


def duration(seconds: float) -> str:
    """Write a time as people say it, in minutes and seconds.

    Examples
    --------
    >>> from nearfar.progress import duration
    >>> duration(75.2)
    '1 min 15 s'
    """
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"


@contextmanager
def progress_bar(what: str = "working", *, quiet: bool = False) -> Iterator[Report]:
    """Yield a function that draws a bar for what is being done and the share done, 0 to 1.

    On a terminal and in a notebook it draws a bar; elsewhere it draws nothing. It is what
    `nearfar.acquire`, `nearfar.reconstruct` and others take as `progress`.

    Parameters
    ----------
    what : str
        What is being done until the job itself says so.
    quiet : bool
        Draw nothing anywhere.

    Yields
    ------
    callable
        Takes what is being done, a str, and the share of it that is done, 0 to 1.

    Examples
    --------
    >>> with nearfar.progress_bar() as report:
    ...     transport, _ = nearfar.reconstruct(capture, progress=report)
    """
    if quiet:
        yield ignore_progress
    elif _in_notebook():
        yield _in_cell()
    elif sys.stderr.isatty():
        with _on_terminal(what) as report:
            yield report
    else:
        yield ignore_progress


def _in_notebook() -> bool:
    # Without IPython loaded there is no notebook, and no need to load it.
    if "IPython" not in sys.modules:
        return False
    from IPython import get_ipython

    return hasattr(get_ipython(), "kernel")


def _in_cell() -> Report:
    """Draw bars into the output of a notebook's cell; widgets are not needed."""
    from IPython.display import HTML, display

    shares: dict[str, float] = {}
    drawn: dict[str, float] = {}
    handle = display(HTML(""), display_id=True)

    def report(what: str, share: float) -> None:
        shares[what] = share
        if share < 1.0 and share - drawn.get(what, -1.0) < SHARE_BETWEEN_DRAWINGS:
            return
        drawn[what] = share
        bars = "".join(
            f'<div>{escape(name)} <progress value="{done:.3f}" max="1"></progress> {done:.0%}</div>'
            for name, done in shares.items()
        )
        handle.update(HTML(bars))

    return report


@contextmanager
def _on_terminal(what: str) -> Iterator[Report]:
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

    # By a clock of its own: a job whose first step is long reports nothing meanwhile.
    clock = Timer(SECONDS_BEFORE_A_BAR, bars.start)
    clock.daemon = True
    clock.start()
    try:
        yield report
    finally:
        clock.cancel()
        clock.join()
        if bars.live.is_started:
            bars.stop()
