"""Processes that are killed at a chosen moment: before one of their changes to files."""

import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.processes import start

# Events of Python's own that stand for a change, beside a file that is opened to be written.
CHANGES = {"os.mkdir", "os.rename", "os.remove", "os.rmdir", "os.link", "shutil.rmtree"}


def killed_at(
    step: int, folder: Path, work: Callable[..., object], *arguments: object, torn: bool = False
) -> bool:
    """Run a function of a module in a process, and kill that before it changes something.

    Parameters
    ----------
    step : int
        Before which change of a file or folder within `folder` it is killed, the first being 0.
    folder : Path
    work, *arguments
        What is run.
    torn : bool
        Where a file is about to be written, kill when it is there and nothing is in it yet.

    Returns
    -------
    bool
        Whether it was killed; it ended well before otherwise.
    """
    process = start(_run, step, folder, torn, work, arguments)
    process.join()
    assert process.exitcode in {0, -signal.SIGKILL}, process.exitcode
    return process.exitcode != 0


def _run(
    step: int, folder: Path, torn: bool, work: Callable[..., object], arguments: tuple[object, ...]
) -> None:
    within = f"{folder}{os.sep}"
    steps = 0

    def count(event: str, about: tuple[Any, ...]) -> None:
        nonlocal steps
        writes = event == "open" and (about[2] or 0) & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)
        if not (writes or event in CHANGES) or not str(about[0]).startswith(within):
            return
        steps += 1
        if steps == step + 1:
            if writes and torn:
                Path(about[0]).touch()
            os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(count)
    work(*arguments)
