"""Pieces of work side by side in threads: NumPy lets go of the interpreter while it computes."""

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from threadpoolctl import threadpool_limits

from nearfar.arrays import processors

Part = TypeVar("Part")

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
