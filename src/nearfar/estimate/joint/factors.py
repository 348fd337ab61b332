"""Small linear algebra within compiled loops: Cholesky factors and triangular systems.

LAPACK through SciPy keeps the interpreter lock, so that threads would wait for each other.

Index convention: arrays are float64; i and j run over responses, c over right sides.
"""

import numpy as np

from nearfar.arrays import Floats
from nearfar.compiled import compiled


@compiled
def _less_eight(row: Floats, rows: Floats, first: int, factors: Floats, start: int) -> None:
    """Subtract eight rows from another, each times a factor of (8,), from an entry on."""
    a, b, c, d = rows[first], rows[first + 1], rows[first + 2], rows[first + 3]
    e, f, g, h = rows[first + 4], rows[first + 5], rows[first + 6], rows[first + 7]
    ta, tb, tc, td = factors[0], factors[1], factors[2], factors[3]
    te, tf, tg, th = factors[4], factors[5], factors[6], factors[7]
    for j in range(start, len(row)):
        less = (ta * a[j] + tb * b[j]) + (tc * c[j] + td * d[j])
        more = (te * e[j] + tf * f[j]) + (tg * g[j] + th * h[j])
        row[j] -= less + more


@compiled
def factorise(matrix: Floats) -> bool:
    """Overwrite the upper triangle of a symmetric matrix (R, R) by U, where it is U^T U.

    Return whether it is positive definite. The lower triangle is not read.
    """
    count = len(matrix)
    for first in range(0, count, 8):
        last = min(first + 8, count)
        for k in range(first, last):
            own = matrix[k]
            for h in range(first, k):
                other, factor = matrix[h], matrix[h, k]
                for j in range(k, count):
                    own[j] -= factor * other[j]
            if not own[k] > 0.0:
                return False
            scale = 1.0 / np.sqrt(own[k])
            for j in range(k, count):
                own[j] *= scale
        if last < count:
            for i in range(last, count):
                _less_eight(matrix[i], matrix, first, matrix[first:last, i], i)
    return True


@compiled
def forwards(factor: Floats, right: Floats) -> None:
    """Overwrite right sides (R, c) by U^-T times them."""
    count = len(factor)
    for i in range(count):
        row = right[i]
        for k in range(0, i - 7, 8):
            _less_eight(row, right, k, factor[k : k + 8, i], 0)
        for k in range(i - i % 8, i):
            other, times = right[k], factor[k, i]
            for c in range(len(row)):
                row[c] -= times * other[c]
        scale = 1.0 / factor[i, i]
        for c in range(len(row)):
            row[c] *= scale


@compiled
def backwards(factor: Floats, right: Floats) -> None:
    """Overwrite right sides (R, c) by U^-1 times them."""
    count = len(factor)
    for i in range(count - 1, -1, -1):
        row = right[i]
        after = i + 1
        while after + 8 <= count:
            _less_eight(row, right, after, factor[i, after : after + 8], 0)
            after += 8
        for k in range(after, count):
            other, times = right[k], factor[i, k]
            for c in range(len(row)):
                row[c] -= times * other[c]
        scale = 1.0 / factor[i, i]
        for c in range(len(row)):
            row[c] *= scale


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
