"""Computations that requests ask for, one at a time in a thread of their own."""

import asyncio
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

from nearfar.errors import NearfarError

MAXIMUM_JOBS = 16

R = TypeVar("R")


class ExhaustedError(Exception):
    """An iterator has no more items; a thread cannot raise StopIteration into a coroutine."""


def next_of(iterator: Iterator[R]) -> R:
    """Return the next item, as a job of its own.

    Raises
    ------
    ExhaustedError
        If there is none.
    """
    for item in iterator:
        return item
    raise ExhaustedError


class BusyError(NearfarError):
    """Too many jobs are waiting already."""


class JobQueue:
    """Run one job at a time, in the order of submission; at most `MAXIMUM_JOBS` run or wait."""

    def __init__(self) -> None:
        self._thread = ThreadPoolExecutor(max_workers=1)
        self._jobs = 0

    async def run(self, job: Callable[..., R], *args: Any) -> R:
        """Run a job and return its result, even if whoever submitted an earlier one is gone.

        Raises
        ------
        BusyError
            If `MAXIMUM_JOBS` run or wait already.
        """
        if self._jobs >= MAXIMUM_JOBS:
            raise BusyError("too much is asked for at once: wait a moment, and ask again.")
        self._jobs += 1
        try:
            return await asyncio.get_running_loop().run_in_executor(self._thread, job, *args)
        finally:
            self._jobs -= 1
