r"""Gains of lamps from reference photos that show several of them at once.

Reference photo k is s_k sum_n A_kn g_n B_n + noise: B_n the photo under lamp n alone, g_n >= 0 its
gain, A_kn the share at which it is lit, and s_k the exposure of the reference, 1 on average. With
w = s_k A_k g, what is left of a reference has the variance of a photo's noise times

    1 + |w|^2 + (1 - w.1)^2,

the last where one photo of black was subtracted from all. The noise of the B_n would make gains
too small; it is estimated from what is left, and taken out of the normal equations. Errors follow
from these, and are widened where gains without one band of camera rows differ by more (the
jackknife of Quenouille and Tukey). In a band, the references are foretold by the other bands.

Index convention: j runs over bands, k over references, n over lamps.
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import nnls

from nearfar.arrays import Floats

# Expected standard deviations of a reference's exposure about 1, and of a gain.
EXPOSURE_DEVIATION = 0.05
GAIN_DEVIATION = 0.5
# The fit of gains and exposures in turn ends when no gain changes by more.
TOLERANCE = 1e-7
MOST_ROUNDS = 200
# Share of the largest diagonal entry that is added, against rounding.
RIDGE = 1e-12


class Sums(NamedTuple):
    """Sums over the values of bands of camera rows.

    Attributes
    ----------
    lamps : ndarray, shape (j, n, n)
        Of products of two lamps' photos.
    crossed : ndarray, shape (j, k, n)
        Of products of a reference and a lamp's photo.
    references : ndarray, shape (j, k)
        Of squares of references.
    values : ndarray, shape (j,)
        How many.
    """

    lamps: Floats
    crossed: Floats
    references: Floats
    values: Floats


class LampGains(NamedTuple):
    """Gains of lamps, and how far they explain the references.

    Attributes
    ----------
    gains : ndarray, shape (n,)
    errors : ndarray, shape (n, n)
        Root of the gains' covariance: it is errors^T errors.
    exposures : ndarray, shape (k,)
    held_out_snr : ndarray, shape (k,)
        SNR_b of each reference in bands that the fit has not seen, dB.
    """

    gains: Floats
    errors: Floats
    exposures: Floats
    held_out_snr: Floats

    @property
    def deviations(self) -> Floats:
        """Standard deviation of each gain, (n,)."""
        return np.asarray(np.sqrt((self.errors**2).sum(axis=0)))


def sums_of(bands: Iterable[tuple[Floats, Floats]]) -> Sums:
    """Sum over bands, each of lamps' photos (n, values) and references (k, values)."""
    lamps, crossed, references, counts = [], [], [], []
    for of_lamps, of_references in bands:
        lamps.append(of_lamps @ of_lamps.T)
        crossed.append(of_references @ of_lamps.T)
        references.append((of_references**2).sum(axis=1))
        counts.append(of_lamps.shape[1])
    return Sums(
        *(np.array(part, dtype=np.float64) for part in (lamps, crossed, references, counts))
    )


def fit_gains(sums: Sums, lit: Floats, *, share_black: bool) -> LampGains:
    """Fit the gains of lamps.

    Parameters
    ----------
    sums : Sums
    lit : ndarray, shape (k, n)
        A, the share at which each lamp is lit in each reference.
    share_black : bool
        Whether one photo of black was subtracted from all.

    Returns
    -------
    LampGains
    """
    fit = _fit(Sums(*(part.sum(axis=0) for part in sums)), lit, share_black=share_black)
    without = []
    error = np.zeros(len(lit))
    for band in range(len(sums.values)):
        others = Sums(*(part.sum(axis=0) - part[band] for part in sums))
        found = _fit(others, lit, share_black=share_black)
        without.append(found.gains)
        mine = Sums(*(part[band] for part in sums))
        error += _left(mine, _weights(lit, found.gains, found.exposures))
    power = sums.references.sum(axis=0)
    snr = 10 * np.log10(np.maximum(power, 1e-300) / np.maximum(error, 1e-15 * power + 1e-300))
    return LampGains(fit.gains, _errors(fit, np.array(without)), fit.exposures, snr)


def spread_of(weights: Floats, *, share_black: bool) -> Floats:
    """Return the variance of what is left of references over that of a photo, (k,).

    Parameters
    ----------
    weights : ndarray, shape (k, n)
        w, what each lamp's photo is multiplied by in each reference.
    share_black : bool
    """
    of_black = (1.0 - weights.sum(axis=1)) ** 2 if share_black else 0.0
    return np.asarray(1.0 + (weights**2).sum(axis=1) + of_black)


class _Fit(NamedTuple):
    """Gains, exposures, and the precision of the gains: normal matrix over variance, and prior."""

    gains: Floats
    exposures: Floats
    information: Floats
    prior: float


def _weights(lit: Floats, gains: Floats, exposures: Floats) -> Floats:
    return exposures[:, None] * lit * gains


def _fit(sums: Sums, lit: Floats, *, share_black: bool) -> _Fit:
    """Fit gains, exposures and noise in turn to all values together."""
    gains: Floats = np.ones(lit.shape[1])
    exposures: Floats = np.ones(len(lit))
    values = max(float(sums.values), 1.0)
    noise = 0.0
    information = np.zeros_like(sums.lamps)
    for _ in range(MOST_ROUNDS):
        # Without what noise adds to squares and products of photos.
        shared = noise * values * share_black
        lamps = sums.lamps - noise * values * np.eye(len(gains)) - shared
        crossed = sums.crossed - shared
        weights = _weights(lit, gains, exposures)
        variance = max(noise * float(spread_of(weights, share_black=share_black).mean()), 1e-300)
        exposed = exposures[:, None] * lit
        normal = _positive((exposed.T @ exposed) * lamps)
        right = (exposed * crossed).sum(axis=0)
        found = _nonnegative(normal, right, variance / GAIN_DEVIATION**2)
        light = lit * found
        own = np.maximum(np.einsum("kn,nm,km->k", light, lamps, light), 0.0)
        prior = variance / EXPOSURE_DEVIATION**2
        exposures = ((light * crossed).sum(axis=1) + prior) / (own + prior)
        weights = _weights(lit, found, exposures)
        left = float(_left(sums, weights).sum())
        spread = float(spread_of(weights, share_black=share_black).sum())
        noise = left / (max(values - lit.shape[1] / len(lit), 1.0) * spread)
        information = normal / variance
        change, gains = float(np.abs(found - gains).max()), found
        if change < TOLERANCE:
            break
    # What all references share is the unit of the gains.
    scale = float(exposures.mean())
    return _Fit(gains * scale, exposures / scale, information, GAIN_DEVIATION**-2)


def _positive(matrix: Floats) -> Floats:
    """Return the nearest matrix without negative eigenvalues."""
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)


def _nonnegative(normal: Floats, right: Floats, weight: float) -> Floats:
    """Return non-negative gains by the normal equations, near 1 where nothing tells them."""
    matrix = normal.copy()
    matrix[np.diag_indices(len(matrix))] += weight + RIDGE * normal.diagonal().max()
    root = cholesky(matrix, lower=True)
    goal = solve_triangular(root, right + weight, lower=True)
    return np.asarray(nnls(root.T, goal, maxiter=100 * len(right))[0])


def _left(sums: Sums, weights: Floats) -> Floats:
    """Return the sum of squares that is left of each reference, (k,)."""
    own = np.einsum("kn,nm,km->k", weights, sums.lamps, weights)
    left = sums.references - 2 * (weights * sums.crossed).sum(axis=1) + own
    return np.asarray(np.maximum(left, 0.0))


def _errors(fit: _Fit, without: Floats) -> Floats:
    """Return a root of the covariance of gains, (n, n); `without` are those without each band."""
    values, vectors = np.linalg.eigh(fit.information)
    values = np.maximum(values, 0.0)
    bands = len(without)
    scattered = (without - without.mean(axis=0)) @ vectors
    jackknife = (bands - 1) / bands * (scattered**2).sum(axis=0)
    deviations = np.sqrt(np.maximum(1.0 / (values + fit.prior), jackknife))
    return np.asarray((vectors * deviations).T)
