"""Sums over eigenvectors for the log evidence, in one pass over the responses.

Each row of responses is summed by itself, in double precision, so that near ties of prior
components do not hang on which camera pixels stand in a batch.

Index convention: m runs over rows of responses, n over camera pixels, i over eigenvectors, s over
prior scales, t over steps of the table of variance ratios.
"""

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.compiled import compiled

# Of determinants, before its logarithm is taken.
LARGEST_FACTOR = 1e100


@compiled
def sum_squares(
    y: Floats,
    u: Floats,
    v: Floats,
    pixel: Integers,
    first_step: Integers,
    steps_per_scale: int,
    table: tuple[Floats, Floats],
    direct_variance: Floats,
    offset_variance: Floats,
    squares: Floats,
    factors: Floats,
) -> None:
    """Add up squares and log determinants over channels, with o and d integrated out.

    Parameters
    ----------
    y : ndarray, shape (m, R)
        Responses in units of their noise.
    u : ndarray, shape (n, R)
        Responses to unit direct light.
    v : ndarray, shape (n or 0, R)
        Responses to a unit error of the references.
    pixel : ndarray of int, shape (m,)
        Camera pixel of each row.
    first_step : ndarray of int, shape (m,)
        Step of the table of the first prior scale of each row.
    steps_per_scale : int
        Steps of the table from one prior scale to the next.
    table : tuple of ndarray, shapes (T, R) and (T,), float64
        Inverse variances, and their log determinants.
    direct_variance, offset_variance : ndarray, shape (m,), float64
        Variances of direct light, before any photo, and of the references' error, in units of the
        noise.
    squares : ndarray, shape (n, S), float64
        To which squares and log determinants are added.
    factors : ndarray, shape (n, S), float64
        Which are multiplied by the factors of the determinants that these two bring.
    """
    weights, log_determinants = table
    scales, count = squares.shape[1], 6 if len(v) else 3
    products = np.empty((count, y.shape[1]))
    sums = np.empty((count, scales + 1))
    for m in range(len(y)):
        n = pixel[m]
        for i in range(y.shape[1]):
            of_y, of_u = np.float64(y[m, i]), np.float64(u[n, i])
            products[0, i], products[1, i], products[2, i] = of_y * of_y, of_u * of_y, of_u * of_u
            if count > 3:
                of_v = np.float64(v[n, i])
                products[3, i] = of_v * of_y
                products[4, i] = of_v * of_u
                products[5, i] = of_v * of_v
        for p in range(0, count, 3):
            one, other, third = products[p], products[p + 1], products[p + 2]
            # Two scales at once, so that products are read half as often.
            for s in range(0, scales, 2):
                step = first_step[m] + s * steps_per_scale
                weight = weights[step]
                its_next = weights[step + steps_per_scale] if s + 1 < scales else weight
                a, b, c, next_a, next_b, next_c = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
                for i in range(len(weight)):
                    a += weight[i] * one[i]
                    b += weight[i] * other[i]
                    c += weight[i] * third[i]
                    next_a += its_next[i] * one[i]
                    next_b += its_next[i] * other[i]
                    next_c += its_next[i] * third[i]
                sums[p, s], sums[p + 1, s], sums[p + 2, s] = a, b, c
                sums[p, s + 1], sums[p + 1, s + 1], sums[p + 2, s + 1] = next_a, next_b, next_c
        for s in range(scales):
            yy, uy, uu = sums[0, s], sums[1, s], sums[2, s]
            if count > 3:
                # What is left of y and u is independent of o.
                vy, vu, vv = sums[3, s], sums[4, s], sums[5, s]
                factor = 1.0 + offset_variance[m] * vv
                share = offset_variance[m] / factor
                yy, uy, uu = yy - share * vy * vy, uy - share * vu * vy, uu - share * vu * vu
                factors[n, s] *= factor
            factor = 1.0 + direct_variance[m] * uu
            of_direct = direct_variance[m] * uy**2 / factor
            squares[n, s] += yy - of_direct + log_determinants[first_step[m] + s * steps_per_scale]
            factors[n, s] *= factor
            # Of many channels they would be more than any number.
            if factors[n, s] > LARGEST_FACTOR:
                squares[n, s] += np.log(factors[n, s])
                factors[n, s] = 1.0
