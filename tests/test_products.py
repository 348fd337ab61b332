"""Products of few rows and of many."""

import numpy as np
import pytest
from threadpoolctl import threadpool_info

from nearfar.arrays import product, product_by_row

# Kernels of other processors round by where a row stands among those of one block.
ROUNDS_ALIKE = {"SkylakeX", "Cooperlake", "SapphireRapids", "Sandybridge"}


def _units_apart(one, other):
    """Return by how many units of rounding two products differ, at most."""
    size = np.abs(other).max() * np.finfo(other.dtype).eps
    return float(np.abs(one.astype(np.float64) - other).max() / size)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("shape", [(137, 113), (137, 137), (40, 81)])
def test_a_row_rounds_alike_whatever_rows_stand_beside_it(shape, dtype):
    draw = np.random.default_rng(0)
    kernels = {each.get("architecture") for each in threadpool_info()}
    allowed = 0.0 if kernels & ROUNDS_ALIKE else 16.0
    values = draw.normal(size=(700, shape[0])).astype(dtype)
    matrix = draw.normal(size=shape).astype(dtype)
    for one in (matrix, np.asfortranarray(matrix)):
        whole = product_by_row(values, one)
        np.testing.assert_allclose(whole, product(values, one), rtol=1e-3, atol=1e-4)
        for rows in (slice(0, 1), slice(5, 12), slice(333, 398), slice(600, 700)):
            assert _units_apart(product_by_row(values[rows], one), whole[rows]) <= allowed


def test_leading_axes_and_no_rows_at_all_are_as_in_any_product():
    values, matrix = np.ones((3, 2, 5), dtype=np.float32), np.ones((5, 4), dtype=np.float32)
    np.testing.assert_array_equal(product_by_row(values, matrix), np.full((3, 2, 4), 5.0))
    assert product_by_row(values[:0], matrix).shape == (0, 2, 4)
