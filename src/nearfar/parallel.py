"""Pieces of work side by side in threads: NumPy lets go of the interpreter while it computes."""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

from threadpoolctl import threadpool_limits

from nearfar.arrays import processors

Part = TypeVar("Part")
Found = TypeVar("Found")

# Each part holds some hundred megabytes at the largest sizes.
MOST = 8


def side_by_side(work: Callable[[Part], None], parts: Iterable[Part]) -> None:
    """Do the work for every part, on all processors; the parts write to places of their own.

    Matrix products within a part stay on its processor, so that what comes out does not depend
    on how many there are.
    """
    workers = min(MOST, processors())
    with threadpool_limits(1, "blas"), ThreadPoolExecutor(max_workers=workers) as pool:
        # Reading the results raises what a part raised.
        for _ in pool.map(work, parts):
            pass


def ahead(fetch: Callable[[Part], Found], parts: Iterable[Part]) -> Iterator[tuple[Part, Found]]:
    """Yield each part with what is fetched for it; the next is fetched while one is worked at."""
    with ThreadPoolExecutor(max_workers=1) as pool:
        before: tuple[Part, Future[Found]] | None = None
        for part in parts:
            under_way = part, pool.submit(fetch, part)
            if before is not None:
                yield before[0], before[1].result()
            before = under_way
        if before is not None:
            yield before[0], before[1].result()
