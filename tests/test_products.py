"""Products of few rows and of many."""

import numpy as np
import pytest

from nearfar.arrays import product, product_by_row


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("shape", [(137, 113), (137, 137), (40, 81)])
def test_a_row_rounds_alike_whatever_rows_stand_beside_it(shape, dtype):
    draw = np.random.default_rng(0)
    values = draw.normal(size=(700, shape[0])).astype(dtype)
    matrix = draw.normal(size=shape).astype(dtype)
    for one in (matrix, np.asfortranarray(matrix)):
        whole = product_by_row(values, one)
        np.testing.assert_allclose(whole, product(values, one), rtol=1e-3, atol=1e-4)
        for rows in (slice(0, 1), slice(5, 12), slice(333, 398), slice(600, 700)):
            np.testing.assert_array_equal(product_by_row(values[rows], one), whole[rows])


def test_leading_axes_and_no_rows_at_all_are_as_in_any_product():
    values, matrix = np.ones((3, 2, 5), dtype=np.float32), np.ones((5, 4), dtype=np.float32)
    np.testing.assert_array_equal(product_by_row(values, matrix), np.full((3, 2, 4), 5.0))
    assert product_by_row(values[:0], matrix).shape == (0, 2, 4)
