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


@compiled
def put_weighted_sums(
    y: Floats,
    u: Floats,
    v: Floats,
    pixel: Integers,
    steps: Integers,
    weights: Floats,
    sums: Floats,
) -> None:
    """Write weighted sums over eigenvectors of the products of responses, light and errors.

    Parameters
    ----------
    y : ndarray, shape (m, R), float64
        Responses in units of their noise.
    u : ndarray, shape (n, R), float64
        Responses to unit direct light.
    v : ndarray, shape (n or 0, R), float64
        Responses to a unit error of the references.
    pixel : ndarray of int, shape (m,)
        Camera pixel of each row.
    steps : ndarray of int, shape (m, S)
        Step of the table of each row and prior scale.
    weights : ndarray, shape (T, R), float64
        Inverse variances at steps of the table.
    sums : ndarray, shape (3 or 6, m, S), float64
        To be written: of y y, u y and u u, and where there is v of v y, v u and v v.
    """
    count, scales = sums.shape[0], sums.shape[2]
    products = np.empty((count, y.shape[1]))
    for m in range(len(y)):
        n = pixel[m]
        for i in range(y.shape[1]):
            of_y, of_u = y[m, i], u[n, i]
            products[0, i], products[1, i], products[2, i] = of_y * of_y, of_u * of_y, of_u * of_u
            if count > 3:
                of_v = v[n, i]
                products[3, i] = of_v * of_y
                products[4, i] = of_v * of_u
                products[5, i] = of_v * of_v
        for p in range(0, count, 3):
            one, other, third = products[p], products[p + 1], products[p + 2]
            for s in range(0, scales, 2):
                # Two scales at once, so that products are read half as often.
                s_next = min(s + 1, scales - 1)
                weight, its_next = weights[steps[m, s]], weights[steps[m, s_next]]
                a, b, c, next_a, next_b, next_c = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
                for i in range(len(weight)):
                    a += weight[i] * one[i]
                    b += weight[i] * other[i]
                    c += weight[i] * third[i]
                    next_a += its_next[i] * one[i]
                    next_b += its_next[i] * other[i]
                    next_c += its_next[i] * third[i]
                sums[p, m, s], sums[p + 1, m, s], sums[p + 2, m, s] = a, b, c
                sums[p, m, s_next], sums[p + 1, m, s_next] = next_a, next_b
                sums[p + 2, m, s_next] = next_c
