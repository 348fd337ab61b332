"""Sums over eigenvectors for the log evidence, in one pass over the responses.

Each row of responses is summed by itself, in double precision, so that near ties of prior
components do not hang on which camera pixels stand in a batch.

Index convention: m runs over rows of responses, n over camera pixels, i over eigenvectors, s over
prior scales, t over steps of the table of variance ratios.
"""

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.compiled import compiled


@compiled
def sum_squares(
    y: Floats,
    u: Floats,
    pixel: Integers,
    first_step: Integers,
    steps_per_scale: int,
    table: tuple[Floats, Floats],
    direct_variance: Floats,
    squares: Floats,
    factors: Floats,
) -> None:
    """Add up squares and log determinants over the channels of camera pixels, d integrated out.

    Parameters
    ----------
    y : ndarray, shape (m, R), float32
        Responses in units of their noise.
    u : ndarray, shape (n, R), float32
        Responses to unit direct light.
    pixel : ndarray of int, shape (m,)
        Camera pixel of each row.
    first_step : ndarray of int, shape (m,)
        Step of the table of the first prior scale of each row.
    steps_per_scale : int
        Steps of the table from one prior scale to the next.
    table : tuple of ndarray, shapes (T, R) and (T,), float64
        Inverse variances, and their log determinants.
    direct_variance : ndarray, shape (m,), float64
        Prior variance of direct light in units of the noise.
    squares : ndarray, shape (n, S), float64
        To which squares and log determinants are added.
    factors : ndarray, shape (n, S), float64
        Which are multiplied by the factors of the determinants that direct light brings.
    """
    weights, log_determinants = table
    products = np.empty((3, y.shape[1]))
    of_yy, of_uy, of_uu = products[0], products[1], products[2]
    scales = squares.shape[1]
    sums = np.empty((3, scales + 1))
    for m in range(len(y)):
        one, other, n = y[m], u[pixel[m]], pixel[m]
        for i in range(len(one)):
            a, b = np.float64(one[i]), np.float64(other[i])
            of_yy[i], of_uy[i], of_uu[i] = a * a, a * b, b * b
        # Two scales at once, so that products are read half as often.
        for s in range(0, scales, 2):
            step = first_step[m] + s * steps_per_scale
            weight = weights[step]
            its_next = weights[step + steps_per_scale] if s + 1 < scales else weight
            yy, uy, uu, next_yy, next_uy, next_uu = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for i in range(len(weight)):
                yy += weight[i] * of_yy[i]
                uy += weight[i] * of_uy[i]
                uu += weight[i] * of_uu[i]
                next_yy += its_next[i] * of_yy[i]
                next_uy += its_next[i] * of_uy[i]
                next_uu += its_next[i] * of_uu[i]
            sums[0, s], sums[1, s], sums[2, s] = yy, uy, uu
            sums[0, s + 1], sums[1, s + 1], sums[2, s + 1] = next_yy, next_uy, next_uu
        for s in range(scales):
            factor = 1.0 + direct_variance[m] * sums[2, s]
            of_direct = direct_variance[m] * sums[1, s] ** 2 / factor
            step = first_step[m] + s * steps_per_scale
            squares[n, s] += sums[0, s] - of_direct + log_determinants[step]
            factors[n, s] *= factor
