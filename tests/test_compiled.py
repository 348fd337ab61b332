"""Compiled loops: the same as the function, also where they cannot be kept, and made once."""

import sys
from multiprocessing.synchronize import Barrier
from pathlib import Path

import numpy as np

from nearfar.compiled import compiled
from tests.processes import barrier, start

SUM_OF_SQUARES = """
def sum_of_squares(values):
    found = 0.0
    for value in values:
        found += value * value
    return found
"""


def test_without_a_folder_to_keep_it_in_a_loop_is_compiled_for_the_process():
    # Text has no file beside which a cache could be.
    defined = {}
    exec(SUM_OF_SQUARES, defined)
    values = np.random.default_rng(0).random(1000)
    found = compiled(defined["sum_of_squares"])(values)
    np.testing.assert_allclose(found, defined["sum_of_squares"](values), rtol=1e-12)
    assert np.isnan(compiled(defined["sum_of_squares"])(np.array([1.0, np.nan])))


def _sum_in(folder: Path, together: Barrier, number: int) -> None:
    """Sum whole numbers and fractions, in turn, and tell how many signatures were compiled."""
    sys.path.insert(0, str(folder))
    import a_loop

    values = [np.arange(5), np.array([0.5, 1.5])]
    together.wait()
    for these in values if number % 2 else values[::-1]:
        assert a_loop.sum_of_squares(these) == np.sum(these**2)
    misses = sum(a_loop.sum_of_squares.stats.cache_misses.values())
    (folder / f"{number}.misses").write_text(str(misses))


def test_of_processes_that_need_a_loop_at_once_one_compiles_it(tmp_path):
    definition = SUM_OF_SQUARES.replace("def", "@compiled\ndef")
    (tmp_path / "a_loop.py").write_text(f"from nearfar.compiled import compiled\n\n{definition}")
    together = barrier(3)
    processes = [start(_sum_in, tmp_path, together, number) for number in range(3)]
    for process in processes:
        process.join()
        assert process.exitcode == 0
    # Two signatures, whoever came first.
    assert sum(int(path.read_text()) for path in tmp_path.glob("*.misses")) == 2
