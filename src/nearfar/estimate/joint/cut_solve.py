"""Camera pixels that share a covariance of responses: amplitudes, and what is left of responses.

Index convention: m runs over pairs of a camera pixel and a channel, ordered by their ratio; r over
responses, g and h over amplitudes.
"""

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.compiled import compiled
from nearfar.estimate.joint.factors import backwards, factorise, forwards, solve_small


@compiled
def _in_columns(responses: Floats, units: Floats) -> Floats:
    """Return responses (m, R) and those to unit amplitudes (m, G, R) as columns, (R, (1 + G) m).

    All responses come first, then those to each amplitude.
    """
    pairs, number, count = units.shape
    found = np.empty((count, (1 + number) * pairs))
    for r in range(count):
        row = found[r]
        for m in range(pairs):
            row[m] = responses[m, r]
            for g in range(number):
                row[(1 + g) * pairs + m] = units[m, g, r]
    return found


@compiled
def _fit(columns: Floats, precision: Floats, amplitudes: Floats) -> None:
    """Write the amplitudes (m, G) that fit whitened responses, in columns, best."""
    pairs, number = amplitudes.shape
    products = np.zeros((number, 1 + number, pairs))
    for row in columns.reshape(len(columns), 1 + number, pairs):
        for g in range(number):
            of_g = row[1 + g]
            for h in range(g + 2):
                of_h, found = row[h], products[g, h]
                for m in range(len(found)):
                    found[m] += of_g[m] * of_h[m]
    normal = np.empty((number, number))
    for m in range(pairs):
        for g in range(number):
            amplitudes[m, g] = products[g, 0, m]
            for h in range(g + 1):
                normal[g, h] = products[g, 1 + h, m]
            normal[g, g] += precision[m, g]
        solve_small(normal, amplitudes[m])


@compiled
def _left(columns: Floats, amplitudes: Floats) -> Floats:
    """Return responses, of columns, less those to amplitudes (m, G): (R, m)."""
    pairs, number = amplitudes.shape
    found = np.empty((len(columns), pairs))
    of_amplitude = np.empty((number, pairs))
    for m in range(pairs):
        for g in range(number):
            of_amplitude[g, m] = amplitudes[m, g]
    for r in range(len(columns)):
        row, before = found[r], columns[r, :pairs]
        for m in range(len(row)):
            row[m] = before[m]
        for g in range(number):
            unit, amplitude = columns[r, (1 + g) * pairs : (2 + g) * pairs], of_amplitude[g]
            for m in range(len(row)):
                row[m] -= amplitude[m] * unit[m]
    return found


@compiled
def solve_alike(
    covariance: Floats,
    noise_variance: Floats,
    ratios: Floats,
    starts: Integers,
    responses: Floats,
    units: Floats,
    precision: Floats,
) -> tuple[Floats, Floats, bool]:
    """Estimate amplitudes, and weigh what they leave of the responses by the covariance.

    Parameters
    ----------
    covariance : ndarray, shape (R, R), float64
        Of the responses to near- and far-range light, at a variance ratio of 1.
    noise_variance : ndarray, shape (R,), float64
        Of each response, in units of one measurement's.
    ratios : ndarray, shape (Q,), float64
        Variance ratios, K = ratio covariance + diag(noise_variance) for each.
    starts : ndarray of int, shape (Q + 1,)
        First pair of each ratio, and the number of pairs.
    responses : ndarray, shape (m, R), float32
    units : ndarray, shape (m, G, R), float32
        Responses to unit amplitudes.
    precision : ndarray, shape (m, G), float64
        Prior precision of the amplitudes, in units of one measurement's.

    Returns
    -------
    amplitudes : ndarray, shape (m, G), float64
    rest : ndarray, shape (m, R), float64
        Ratio times K^-1 times the responses less those to the amplitudes.
    is_definite : bool
        False, and the rest unfinished, where a covariance is not positive definite.
    """
    number, count = units.shape[1], len(covariance)
    factor = np.empty((count, count))
    amplitudes, rest = np.empty((len(responses), number)), np.empty((len(responses), count))
    for place in range(len(ratios)):
        some = slice(starts[place], starts[place + 1])
        for i in range(count):
            for j in range(i, count):
                factor[i, j] = ratios[place] * covariance[i, j]
            factor[i, i] += noise_variance[i]
        if not factorise(factor):
            return amplitudes, rest, False
        right = _in_columns(responses[some], units[some])
        forwards(factor, right)
        _fit(right, precision[some], amplitudes[some])
        left = _left(right, amplitudes[some])
        backwards(factor, left)
        for r in range(count):
            for m in range(left.shape[1]):
                rest[starts[place] + m, r] = ratios[place] * left[r, m]
    return amplitudes, rest, True
