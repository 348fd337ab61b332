"""Blocks of work side by side in threads: NumPy lets go of the interpreter while it computes."""

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor

from nearfar.arrays import processors

# Each part holds some hundred megabytes at the largest sizes.
MOST = 8


def side_by_side(work: Callable[[slice], None], parts: Iterable[slice]) -> None:
    """Do the work for every part, on all processors; the parts write to places of their own."""
    with ThreadPoolExecutor(max_workers=min(MOST, processors())) as pool:
        # Reading the results raises what a part raised.
        for _ in pool.map(work, parts):
            pass
