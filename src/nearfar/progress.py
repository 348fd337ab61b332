"""Progress of work that takes long: a bar on a terminal, and in a notebook."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from html import escape
from threading import Timer
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import TaskID

# Seconds; a job that ends sooner shows no bar.
PATIENCE = 1.0
# Shares of a job between two drawings in a notebook, each of which is a message.
STEP = 0.01

Report = Callable[[str, float], None]


@contextmanager
def progress_bar(what: str = "working", *, quiet: bool = False) -> Iterator[Report]:
    """Yield a function to tell what is being done and the share done, 0 to 1.

    On a terminal and in a notebook it draws a bar; elsewhere, or if it is to be quiet, nothing. It
    is what `nearfar.reconstruct` and others take as `progress`; `counted` turns it into what
    `nearfar.acquire` takes.

    Parameters
    ----------
    what : str
        What is being done until the job itself tells.
    quiet : bool
        Show nothing.

    Examples
    --------
    >>> with nearfar.progress_bar() as report:  # doctest: +SKIP
    ...     transport, _ = nearfar.reconstruct(capture, progress=report)
    """
    if quiet:
        yield _unheard
    elif _in_notebook():
        yield _in_cell()
    elif sys.stderr.isatty():
        with _on_terminal(what) as report:
            yield report
    else:
        yield _unheard


def counted(report: Report, what: str, total: int) -> Callable[[int], None]:
    """Turn a report of shares into one of counts."""
    return lambda done: report(what, done / max(1, total))


def _unheard(_what: str, _share: float) -> None:
    pass


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
        if share < 1.0 and share - drawn.get(what, -1.0) < STEP:
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
