"""Small linear algebra within compiled loops: Cholesky factors and triangular systems.

LAPACK through SciPy keeps the interpreter lock, so that threads would wait for each other. Rows are
worked on eight at a time, two of them against eight others, so that most numbers stay in registers.

Loops stand where array expressions could, which take several times as long to compile.

Index convention: arrays are float64; i, j and k run over responses, c over right sides.
"""

import numpy as np

from nearfar.arrays import Floats
from nearfar.compiled import compiled


@compiled
def _less_eight(row: Floats, rows: Floats, first: int, times: Floats) -> None:
    """Subtract eight rows from another, each times a factor of (8,)."""
    a, b, c, d = rows[first], rows[first + 1], rows[first + 2], rows[first + 3]
    e, f, g, h = rows[first + 4], rows[first + 5], rows[first + 6], rows[first + 7]
    ta, tb, tc, td = times[0], times[1], times[2], times[3]
    te, tf, tg, th = times[4], times[5], times[6], times[7]
    for j in range(len(row)):
        less = (ta * a[j] + tb * b[j]) + (tc * c[j] + td * d[j])
        more = (te * e[j] + tf * f[j]) + (tg * g[j] + th * h[j])
        row[j] -= less + more


@compiled
def _two_less_eight(
    row: Floats, other: Floats, rows: Floats, first: int, times: Floats, start: int
) -> None:
    """Subtract eight rows from two others, each times factors of (8, 2), from an entry on."""
    # Indices that start at 0 are known not to be negative, which vector instructions need.
    row, other = row[start:], other[start:]
    a, b = rows[first, start:], rows[first + 1, start:]
    c, d = rows[first + 2, start:], rows[first + 3, start:]
    e, f = rows[first + 4, start:], rows[first + 5, start:]
    g, h = rows[first + 6, start:], rows[first + 7, start:]
    ta, tb, tc, td = times[0, 0], times[1, 0], times[2, 0], times[3, 0]
    te, tf, tg, th = times[4, 0], times[5, 0], times[6, 0], times[7, 0]
    ua, ub, uc, ud = times[0, 1], times[1, 1], times[2, 1], times[3, 1]
    ue, uf, ug, uh = times[4, 1], times[5, 1], times[6, 1], times[7, 1]
    for j in range(len(row)):
        less = (ta * a[j] + tb * b[j]) + (tc * c[j] + td * d[j])
        more = (te * e[j] + tf * f[j]) + (tg * g[j] + th * h[j])
        less_too = (ua * a[j] + ub * b[j]) + (uc * c[j] + ud * d[j])
        more_too = (ue * e[j] + uf * f[j]) + (ug * g[j] + uh * h[j])
        row[j] -= less + more
        other[j] -= less_too + more_too


@compiled
def _less_each(right: Floats, i: int, times: Floats, first: int) -> None:
    """Subtract rows from `first` on from row i, each times a factor."""
    row = right[i]
    for k in range(len(times)):
        other = right[first + k]
        for c in range(len(row)):
            row[c] -= times[k] * other[c]


@compiled
def _divide(row: Floats, divisor: float) -> None:
    scale = 1.0 / divisor
    for j in range(len(row)):
        row[j] *= scale


@compiled
def factorise(matrix: Floats) -> bool:
    """Overwrite the upper triangle of a symmetric matrix (R, R) by U, where it is U^T U.

    Return whether it is positive definite. The lower triangle is not read, but overwritten.
    """
    count = len(matrix)
    for first in range(0, count, 8):
        last = min(first + 8, count)
        for k in range(first, last):
            own = matrix[k, k:]
            for h in range(first, k):
                other, times_other = matrix[h, k:], matrix[h, k]
                for j in range(len(own)):
                    own[j] -= times_other * other[j]
            if not own[0] > 0.0:
                return False
            _divide(own, np.sqrt(own[0]))
        for i in range(last, count - 1, 2):
            times = matrix[first:last, i : i + 2]
            _two_less_eight(matrix[i], matrix[i + 1], matrix, first, times, i)
        if last < count and (count - last) % 2:
            _less_eight(matrix[count - 1], matrix, first, matrix[first:last, count - 1])
    return True


@compiled
def forwards(factor: Floats, right: Floats) -> None:
    """Overwrite right sides (R, c) by U^-T times them."""
    count = len(factor)
    for first in range(0, count, 8):
        last = min(first + 8, count)
        for before in range(0, first, 8):
            for i in range(first, last - 1, 2):
                times = factor[before : before + 8, i : i + 2]
                _two_less_eight(right[i], right[i + 1], right, before, times, 0)
            if (last - first) % 2:
                times_last = factor[before : before + 8, last - 1]
                _less_eight(right[last - 1], right, before, times_last)
        for i in range(first, last):
            _less_each(right, i, factor[first:i, i], first)
            _divide(right[i], factor[i, i])


@compiled
def backwards(factor: Floats, right: Floats) -> None:
    """Overwrite right sides (R, c) by U^-1 times them."""
    count = len(factor)
    for first in range((count - 1) // 8 * 8, -1, -8):
        last = min(first + 8, count)
        for after in range(last, count - 7, 8):
            for i in range(first, last, 2):
                times = factor[i : i + 2, after : after + 8].T
                _two_less_eight(right[i], right[i + 1], right, after, times, 0)
        # Rows after the last whole eight.
        beyond = last + (count - last) // 8 * 8
        for i in range(last - 1, first - 1, -1):
            _less_each(right, i, factor[i, beyond:], beyond)
            _less_each(right, i, factor[i, i + 1 : last], i + 1)
            _divide(right[i], factor[i, i])


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
