"""Compiled loops: the same as the function, also where they cannot be kept."""

import numpy as np

from nearfar.compiled import compiled

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
