"""Threads for NumPy, which releases the interpreter lock; one thread for an accelerator."""

import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager
from functools import lru_cache
from typing import Any, TypeVar

from threadpoolctl import ThreadpoolController

from nearfar.arrays import blocks, processors
from nearfar.devices import batch_length, is_on_accelerator

Item = TypeVar("Item")
Fetched = TypeVar("Fetched")

# Each item takes some hundred megabytes at the largest sizes.
MAXIMUM_THREADS = 8


def threads() -> int:
    """Return the number of threads that work is shared among."""
    return min(MAXIMUM_THREADS, processors())


def side_by_side(work: Callable[[Item], None], items: Iterable[Item]) -> None:
    """Call `work` with every item, in threads on all processors; no two may write the same data.

    A matrix product within `work` runs on one processor, so the result does not depend on the
    number of processors.
    """
    everything = list(items)
    count = min(threads(), len(everything))
    with single_threaded_products():
        if count <= 1:
            for item in everything:
                work(item)
            return
        with ThreadPoolExecutor(max_workers=count) as pool:
            # Reading the results raises the errors of the threads.
            for _ in pool.map(work, everything):
                pass


def one_by_one(work: Callable[[Item], None], items: Iterable[Item]) -> None:
    """Call `work` with every item, in this thread."""
    for item in items:
        work(item)


def on_device_of(values: Any) -> Callable[[Callable[[Item], None], Iterable[Item]], None]:
    """Return the function that calls `work` with every item, for the device of `values`.

    It is `side_by_side` on the processor, and `one_by_one` on an accelerator, whose calls hold the
    interpreter lock.
    """
    return one_by_one if is_on_accelerator(values) else side_by_side


def in_batches(work: Callable[[slice], None], count: int, length: int, values: Any) -> None:
    """Call `work` with slices of ``range(count)`` that suit the device of `values`.

    Parameters
    ----------
    work : callable
        No two slices may write the same data.
    count : int
    length : int
        How many items the processor takes at once.
    values : array
    """
    on_device_of(values)(work, blocks(count, batch_length(length, values)))


def single_threaded_products() -> AbstractContextManager[Any]:
    """Return a context in which each matrix product runs on one processor.

    Several products run at the same time instead, so the result does not depend on the number of
    processors.
    """
    limited: AbstractContextManager[Any] = _libraries(len(sys.modules)).limit(
        limits=1, user_api="blas"
    )
    return limited


@lru_cache(maxsize=1)
def _libraries(_modules: int) -> ThreadpoolController:
    """Return the BLAS libraries, which are looked for again where more modules are loaded."""
    return ThreadpoolController()


def ahead(
    fetch: Callable[[Item], Fetched], items: Iterable[Item]
) -> Iterator[tuple[Item, Fetched]]:
    """Yield each item with what `fetch` returns for it; the next is fetched in the meantime."""
    with ThreadPoolExecutor(max_workers=1) as pool:
        before: tuple[Item, Future[Fetched]] | None = None
        for item in items:
            pending = item, pool.submit(fetch, item)
            if before is not None:
                yield before[0], before[1].result()
            before = pending
        if before is not None:
            yield before[0], before[1].result()
