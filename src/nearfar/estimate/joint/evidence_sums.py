"""Weighted sums over eigenvectors for the log evidence, in one pass over the responses.

Index convention: m runs over rows of responses, n over camera pixels, i over eigenvectors, s over
prior scales, t over steps of the table of variance ratios.
"""

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.compiled import compiled


@compiled
def sums_of_products(
    one: Floats,
    other: Floats,
    of_one: Integers,
    of_other: Integers,
    steps: Integers,
    weights: Floats,
) -> Floats:
    """Return the weighted sums of the squares and of the product of two rows each, (3, m, S).

    Parameters
    ----------
    one, other : ndarray, shape (n, R), float32
    of_one, of_other : ndarray of int, shape (m,)
        Rows that belong together.
    steps : ndarray of int, shape (m, S)
        Rows of `weights` for them.
    weights : ndarray, shape (T, R), float32

    Returns
    -------
    ndarray, shape (3, m, S), float64
        Of one squared, of the product, of the other squared.
    """
    found = np.empty((3, *steps.shape))
    buffers = np.empty((3, one.shape[1]), dtype=np.float32)
    squares, products, others = buffers[0], buffers[1], buffers[2]
    for m in range(len(steps)):
        a, b = one[of_one[m]], other[of_other[m]]
        for i in range(len(a)):
            squares[i] = a[i] * a[i]
            products[i] = a[i] * b[i]
            others[i] = b[i] * b[i]
        for s in range(steps.shape[1]):
            weight = weights[steps[m, s]]
            first, second, third = 0.0, 0.0, 0.0
            for i in range(len(weight)):
                first += weight[i] * squares[i]
                second += weight[i] * products[i]
                third += weight[i] * others[i]
            found[0, m, s] = first
            found[1, m, s] = second
            found[2, m, s] = third
    return found
