"""Amplitudes of camera pixels where the covariance of responses is diagonal.

Index convention: m runs over responses of a channel of a camera pixel, n over camera pixels; i over
eigenvectors, g and h over amplitudes.
"""

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.compiled import compiled
from nearfar.estimate.joint.factors import solve_small


@compiled
def _dot(one: Floats, other: Floats) -> float:
    found = 0.0
    for i in range(len(one)):
        found += one[i] * other[i]
    return found


@compiled
def fit_diagonal(
    responses: Floats,
    units: Floats,
    pixel: Integers,
    eigenvalues: Floats,
    noise_variance: Floats,
    prior_variance: Floats,
    precision: Floats,
) -> Floats:
    """Estimate amplitudes, and overwrite responses by what is left of them, weighted.

    Parameters
    ----------
    responses : ndarray, shape (m, R), float32
        Overwritten by prior_variance / (prior_variance eigenvalues + noise_variance) times
        themselves less the responses to the amplitudes.
    units : ndarray, shape (n, G, R), float32
        Responses to unit amplitudes.
    pixel : ndarray of int, shape (m,)
        Camera pixel of each.
    eigenvalues : ndarray, shape (R,), float32
    noise_variance, prior_variance : ndarray, shape (m,), float32
    precision : ndarray, shape (m, G), float64
        Prior precision of the amplitudes.

    Returns
    -------
    ndarray, shape (m, G), float64
    """
    number, count = units.shape[1:]
    amplitudes, normal = np.empty((len(responses), number)), np.empty((number, number))
    weight = np.empty(count, dtype=np.float32)
    weighted = np.empty((number, count), dtype=np.float32)
    for m in range(len(responses)):
        y, unit = responses[m], units[pixel[m]]
        for i in range(count):
            weight[i] = np.float32(1.0) / (prior_variance[m] * eigenvalues[i] + noise_variance[m])
        for g in range(number):
            for i in range(count):
                weighted[g, i] = weight[i] * unit[g, i]
            amplitudes[m, g] = _dot(weighted[g], y)
            for h in range(g + 1):
                normal[g, h] = _dot(weighted[g], unit[h])
            normal[g, g] += precision[m, g]
        solve_small(normal, amplitudes[m])
        for g in range(number):
            amplitude = np.float32(amplitudes[m, g])
            for i in range(count):
                y[i] -= amplitude * unit[g, i]
        for i in range(count):
            y[i] *= weight[i] * prior_variance[m]
    return amplitudes
