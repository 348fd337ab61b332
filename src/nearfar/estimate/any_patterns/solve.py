"""Posterior means of camera pixels of one rounded q, from photos of any patterns.

In units of the noise, photos have the covariance K = rho A + 1 about b + d a. There a is the
sequence of direct light and rho the variance ratio (s / sigma)^2 of prior scale and noise. Nothing
is known of b, d and sigma before: b and d have flat priors, and sigma has the value that makes the
photos most probable. With N' photos beyond those that b and d take, the log evidence is

    -N'/2 log sigma^2 - 1/2 log|K| - 1/2 log|G^T K^-1 G|,   sigma^2 = r^T K^-1 r / N'.

Index convention: arrays are (n, N), camera pixels and channels together; g runs over b and d.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from nearfar.arrays import Floats


class Solved(NamedTuple):
    """Camera pixels under one component and variance ratio.

    Attributes
    ----------
    evidence : ndarray, shape (n,)
        Its logarithm.
    amplitudes : ndarray, shape (n, g)
    weights : ndarray, shape (n, N)
        K^-1 r, r what b and d leave: what n and F are sums of.
    variance : ndarray, shape (n,)
        sigma^2.
    """

    evidence: Floats
    amplitudes: Floats
    weights: Floats
    variance: Floats


def solve(photos: Floats, known: Floats, covariance: Floats, ratio: float) -> Solved:
    """Solve for camera pixels that share their sequences of direct light.

    Parameters
    ----------
    photos : ndarray, shape (n, N)
    known : ndarray, shape (n, N, g)
        Sequences of unit black and unit direct light of each camera pixel.
    covariance : ndarray, shape (N, N)
        A.
    ratio : float
        rho.
    """
    number, amplitudes = known.shape[1:]
    inverse = inverted(covariance, ratio)
    solved = inverse.of_sequences(np.concatenate([photos[:, :, None], known], axis=2))
    normal = information(known, solved[:, :, 1:])
    right = np.einsum("nkg,nk->ng", known, solved[:, :, 0])
    found = np.linalg.solve(normal, right[:, :, None])[:, :, 0]
    weights = solved[:, :, 0] - np.einsum("nkg,ng->nk", solved[:, :, 1:], found)
    left = np.einsum("nk,nk->n", photos, weights)
    free = max(1, number - amplitudes)
    variance = np.maximum(left, np.finfo(np.float64).tiny) / free
    _, of_known = np.linalg.slogdet(normal)
    evidence = -0.5 * (free * np.log(variance) + inverse.log_determinant + of_known)
    return Solved(evidence, found, weights, variance)


class Inverse(NamedTuple):
    """K^-1 by its Cholesky factor.

    Attributes
    ----------
    factor : ndarray, shape (N, N)
        Lower triangle.
    """

    factor: Floats

    @property
    def log_determinant(self) -> float:
        """log|K|."""
        return float(2 * np.log(np.diag(self.factor)).sum())

    def of(self, columns: Floats) -> Floats:
        """Return K^-1 times columns (N, m)."""
        return np.asarray(cho_solve((self.factor, True), columns, check_finite=False))

    def of_sequences(self, sequences: Floats) -> Floats:
        """Return K^-1 times the sequences of each camera pixel, (n, N, m)."""
        count, number, _ = sequences.shape
        stacked = np.moveaxis(sequences, 1, 0).reshape(number, -1)
        return np.moveaxis(self.of(stacked).reshape(number, count, -1), 0, 1)


def inverted(covariance: Floats, ratio: float) -> Inverse:
    """Return the inverse of K = rho A + 1.

    Parameters
    ----------
    covariance : ndarray, shape (N, N)
        A.
    ratio : float
        rho.
    """
    matrix = ratio * covariance
    matrix[np.diag_indices(len(matrix))] += 1.0
    return Inverse(cho_factor(matrix, lower=True, overwrite_a=True, check_finite=False)[0])


def information(known: Floats, solved: Floats) -> Floats:
    """Return G^T K^-1 G, (n, g, g), from G and K^-1 G, both (n, N, g)."""
    found = np.einsum("nkg,nkh->ngh", known, solved)
    each = np.arange(known.shape[2])
    # A camera pixel at which a is constant cannot tell d from b.
    found[:, each, each] *= 1.0 + 1e-9
    return np.asarray(found)


class Rotated(NamedTuple):
    """A covariance by its eigenvectors, under which every variance ratio is cheap.

    Attributes
    ----------
    eigenvalues : ndarray, shape (N,)
    eigenvectors : ndarray, shape (N, N)
    """

    eigenvalues: Floats
    eigenvectors: Floats


def rotated(covariance: Floats) -> Rotated:
    """Return the eigenvalues and eigenvectors of a covariance A."""
    values, vectors = np.linalg.eigh(covariance)
    return Rotated(np.maximum(values, 0.0), vectors)


def log_evidence(photos: Floats, known: Floats, of: Rotated, ratios: Sequence[float]) -> Floats:
    """Return the log evidence of each variance ratio, (ratios, n); see `solve`.

    Parameters
    ----------
    photos : ndarray, shape (n, N)
    known : ndarray, shape (n, N, g)
    of : Rotated
    ratios : sequence of float
    """
    number, amplitudes = known.shape[-2:]
    y = photos @ of.eigenvectors
    g = np.swapaxes(known, -1, -2) @ of.eigenvectors
    variance = np.asarray(ratios)[:, None] * of.eigenvalues + 1.0
    weight = 1.0 / variance
    yy = weight @ (y**2).T
    gy = np.einsum("tk,ngk->tng", weight, g * y[:, None], optimize=True)
    gg = np.einsum("tk,nghk->tngh", weight, g[:, :, None] * g[:, None], optimize=True)
    # A camera pixel at which a is constant cannot tell d from b.
    gg *= 1.0 + 1e-9 * np.eye(amplitudes)
    found = np.linalg.solve(gg, gy[..., None])[..., 0]
    left = np.maximum(yy - np.einsum("tng,tng->tn", found, gy), np.finfo(np.float64).tiny)
    free = max(1, number - amplitudes)
    determinant = np.log(variance).sum(axis=1)[:, None] + np.linalg.slogdet(gg)[1]
    return np.asarray(-0.5 * (free * np.log(left / free) + determinant))
