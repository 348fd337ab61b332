"""Threads for NumPy's work: it releases the interpreter lock while it computes."""

import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager
from functools import lru_cache
from typing import Any, TypeVar

from threadpoolctl import ThreadpoolController

from nearfar.arrays import processors

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
