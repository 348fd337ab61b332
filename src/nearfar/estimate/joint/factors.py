"""Small linear algebra within compiled loops.

Loops stand where array expressions could, which take several times as long to compile.
"""

import numpy as np

from nearfar.arrays import Floats
from nearfar.compiled import compiled


@compiled
def solve_small(matrix: Floats, right: Floats) -> None:
    """Overwrite a right side (G,) by the inverse of a positive definite matrix (G, G) times it.

    The matrix is overwritten too; of it, the lower triangle is read.
    """
    count = len(right)
    for i in range(count):
        for j in range(i + 1):
            value = matrix[i, j]
            for k in range(j):
                value -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = np.sqrt(value) if i == j else value / matrix[j, j]
        value = right[i]
        for k in range(i):
            value -= matrix[i, k] * right[k]
        right[i] = value / matrix[i, i]
    for i in range(count - 1, -1, -1):
        value = right[i]
        for k in range(i + 1, count):
            value -= matrix[k, i] * right[k]
        right[i] = value / matrix[i, i]
