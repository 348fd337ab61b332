"""What a store's own threads have under way: writes into a folder that is given up, and reads.

An interrupt reaches the main thread alone: what it had asked the store's event loop to write goes
on. Before the folder is removed the loop is waited for, and what has not begun by then is dropped,
so that no write fails on a folder that is gone, and no task is left pending. A fault of one chunk
that is read leaves those of others going in the same way: if the process ended then, Python would
complain of each.
"""

import asyncio
import contextlib
from collections.abc import Callable
from pathlib import Path
from weakref import WeakSet

# Seconds that what is under way may take to end; a disk that hangs is not waited for.
MAXIMUM_WAIT_SECONDS = 2.0

_loops: WeakSet[asyncio.AbstractEventLoop] = WeakSet()
_abandoned: set[Path] = set()


def wait_for_this_loop() -> None:
    """Have `settle` wait for the event loop in which this is called."""
    _loops.add(asyncio.get_running_loop())


async def write_into(folder: Path, write: Callable[[], None]) -> None:
    """Call `write`, which adds to `folder`, in a thread; do nothing once that is abandoned."""
    if folder not in _abandoned:
        wait_for_this_loop()
        await asyncio.to_thread(write)


def abandon(folder: Path) -> None:
    """Let writes into `folder` that are under way end, and no other begin."""
    _abandoned.add(folder)
    settle()


def admit(folder: Path) -> None:
    """Let writes into `folder` begin again after it was abandoned."""
    _abandoned.discard(folder)


def settle() -> None:
    """Let reads and writes that are under way end."""
    for loop in [loop for loop in _loops if loop.is_running()]:
        with contextlib.suppress(TimeoutError):
            asyncio.run_coroutine_threadsafe(_others(), loop).result(2 * MAXIMUM_WAIT_SECONDS)


async def _others() -> None:
    tasks = asyncio.all_tasks() - {asyncio.current_task()}
    if tasks:
        await asyncio.wait(tasks, timeout=MAXIMUM_WAIT_SECONDS)
