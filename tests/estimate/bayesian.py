"""The paper's own solver for equation (10): sparse Bayesian learning, pixel by pixel.

Each window entry has a Gaussian prior of its own width, and the widths are those under which the
photos are most probable (Tipping 2001; Ji, Xue and Carin 2008). Slow, and here to hold the
batched solver against.
"""

import numpy as np

from nearfar.arrays import Booleans, Floats

MAXIMUM_ITERATIONS = 300
# Shares of the noise: a change that ends the iterations, and, in variance, a prior that is a zero.
TOLERANCE = 1e-5
PRUNED = 1e-6


def solve_bayesian(n0: Floats, unseen: Floats, inside: Booleans, noise: Floats) -> Floats:
    """Estimate sparse windows one by one.

    Parameters
    ----------
    n0 : ndarray, shape (I, W^2)
        Measured part of each window, orthogonal to `unseen`.
    unseen : ndarray, shape (W^2, m)
        Orthonormal directions that no photo sees.
    inside : ndarray of bool, shape (I, W^2)
        Window entries on the projector.
    noise : ndarray, shape (I,)
        Standard deviation of an entry of `n0`, above 0.

    Returns
    -------
    ndarray, shape (I, W^2), float64
        Posterior means.
    """
    seen = np.eye(len(unseen)) - unseen.astype(np.float64) @ unseen.T.astype(np.float64)
    return np.stack(
        [
            _row(row.astype(np.float64), seen, where, float(deviation) ** 2)
            for row, where, deviation in zip(n0, inside, noise, strict=True)
        ]
    )


def _row(n0: Floats, seen: Floats, inside: Booleans, variance: float) -> Floats:
    """Fixed-point updates of the prior's widths (MacKay), entries pruned as they vanish."""
    active = np.flatnonzero(inside)
    width = np.full(len(active), max(float(np.mean(n0**2)), variance))
    mean = np.zeros(len(active))
    for _ in range(MAXIMUM_ITERATIONS):
        design = seen[:, active]
        # In the data's coordinates, the noise lives in the seen subspace.
        precision = design.T @ design / variance + np.diag(1.0 / width)
        covariance = np.linalg.inv(precision)
        previous, mean = mean, covariance @ (design.T @ n0) / variance
        certain = np.clip(1.0 - np.diag(covariance) / width, 1e-12, 1.0)
        width = mean**2 / certain
        kept = width > PRUNED * variance
        settled = np.max(np.abs(mean - previous), initial=0.0) < TOLERANCE * np.sqrt(variance)
        if kept.all() and settled:
            break
        active, width, mean = active[kept], width[kept], mean[kept]
        if not len(active):
            break
    found = np.zeros(len(n0))
    found[active] = mean
    return found
