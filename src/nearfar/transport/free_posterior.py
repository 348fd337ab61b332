"""The posterior of free rows: how far light from each lamp is known at each camera pixel.

Photos of patterns L (N, P) of lamps are y = b + L t + noise. A row t is m + r: the same m for every
lamp, of which nothing is known before, and r of variance s^2 each. With b and m taken out of the
photos, L has singular values S and right singular vectors W. At a variance ratio
rho = (s / sigma)^2, the variance of l.t is, in units of sigma^2,

    (l.1)^2 v + rho |u|^2 - sum_i (W_i.u)^2 rho^2 S_i^2 / (rho S_i^2 + 1),   u = l - (l.1) a,

v the variance of m, and a what a lamp adds to the estimate of m. Direct light from lamp q is a
number of which nothing is known before either, and adds variance of its own.

Index convention: i runs over singular vectors, p over lamps.
"""

from dataclasses import dataclass

import numpy as np

from nearfar.arrays import Floats

# Beyond this variance ratio, rows are least squares: what no photo tells has no finite variance.
LEAST_SQUARES = np.float32(np.inf)


@dataclass(frozen=True, eq=False)
class FreePosterior:
    """Singular vectors of the patterns, and the variance ratio of each camera pixel.

    Attributes
    ----------
    modes : ndarray, shape (k, P), float32
        W.
    strengths : ndarray, shape (k,), float32
        S, above 0.
    mean : ndarray, shape (P,), float32
        a; 0 where m is 0.
    mean_variance : float
        v.
    gain_errors : ndarray, shape (j, P), float32
        Root of the covariance of the lamps' gains, as shares of the gains: light stages.
    ratio : ndarray, shape (Cy, Cx), float32
        rho; infinite for least squares.
    """

    modes: Floats
    strengths: Floats
    mean: Floats
    mean_variance: float
    gain_errors: Floats
    ratio: Floats


# Arrays that all camera pixels share, and one value for each camera pixel.
SHARED = ("modes", "strengths", "mean", "gain_errors")
OF_PIXELS = ("ratio",)
