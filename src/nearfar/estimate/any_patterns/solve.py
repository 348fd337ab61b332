"""Posterior means of camera pixels of one rounded q, from photos of any patterns.

In units of the noise, photos have the covariance K = rho A + 1 about G theta. There theta are
amplitudes of known sequences G: black b, direct light d, and what neighbours lead to expect. rho is
the variance ratio (s / sigma)^2 of prior scale and noise. Amplitudes have the prior precision Q,
about 0 and in units of the noise, 0 where nothing is known of them before. sigma has the value that
makes the photos most probable. With N' photos beyond those that amplitudes without prior take, the
log evidence is

    -N'/2 log sigma^2 - 1/2 log|K| - 1/2 log|G^T K^-1 G + Q| + 1/2 log|Q|,
    sigma^2 = r^T K^-1 y / N',

r what the amplitudes leave of the photos y, and |Q| over those with a prior alone.

Index convention: arrays are (n, N), camera pixels and channels together; g runs over amplitudes.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from nearfar.arrays import Floats, Integers


class Solved(NamedTuple):
    """Camera pixels under one component and variance ratio.

    Attributes
    ----------
    evidence : ndarray, shape (n,)
        Its logarithm.
    amplitudes : ndarray, shape (n, g)
    weights : ndarray, shape (n, N)
        K^-1 r: what n and F are sums of.
    variance : ndarray, shape (n,)
        sigma^2.
    """

    evidence: Floats
    amplitudes: Floats
    weights: Floats
    variance: Floats


class Sequences(NamedTuple):
    """Photos of camera pixels, and what they are taken apart into.

    Attributes
    ----------
    photos : ndarray, shape (n, N)
    known : ndarray, shape (n, N, g)
        G: sequences of unit amplitudes.
    precision : ndarray, shape (n, g)
        Diagonal of Q.
    """

    photos: Floats
    known: Floats
    precision: Floats

    def of(self, selected: Integers) -> "Sequences":
        """Return the sequences of some of the camera pixels."""
        return Sequences._make(part[selected] for part in self)

    @property
    def free(self) -> Floats:
        """N', (n,)."""
        count = self.photos.shape[1] - (self.precision == 0).sum(axis=1)
        return np.asarray(np.maximum(count, 1), dtype=np.float64)

    @property
    def log_prior(self) -> Floats:
        """log|Q|, (n,)."""
        return np.asarray(np.log(np.where(self.precision > 0, self.precision, 1.0)).sum(axis=1))


def solve(seen: Sequences, covariance: Floats, ratio: float) -> Solved:
    """Solve for camera pixels that share their covariance.

    Parameters
    ----------
    seen : Sequences
    covariance : ndarray, shape (N, N)
        A.
    ratio : float
        rho.
    """
    photos, known, precision = seen
    inverse = inverted(covariance, ratio)
    solved = inverse.of_sequences(np.concatenate([photos[:, :, None], known], axis=2))
    normal = information(known, solved[:, :, 1:], precision)
    right = np.einsum("nkg,nk->ng", known, solved[:, :, 0])
    found = np.linalg.solve(normal, right[:, :, None])[:, :, 0]
    weights = solved[:, :, 0] - np.einsum("nkg,ng->nk", solved[:, :, 1:], found)
    left = np.einsum("nk,nk->n", photos, weights)
    variance = np.maximum(left, np.finfo(np.float64).tiny) / seen.free
    of_known = np.linalg.slogdet(normal)[1] - seen.log_prior
    evidence = -0.5 * (seen.free * np.log(variance) + inverse.log_determinant + of_known)
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


def information(known: Floats, solved: Floats, precision: Floats) -> Floats:
    """Return G^T K^-1 G + Q, (n, g, g), from G and K^-1 G, (n, N, g), and the diagonal of Q."""
    found = np.einsum("nkg,nkh->ngh", known, solved)
    return _regular(found, precision)


def _regular(normal: Floats, precision: Floats) -> Floats:
    """Add a prior precision (n, g) to normal matrices (..., n, g, g), in place."""
    each = np.arange(normal.shape[-1])
    # A camera pixel at which a is constant cannot tell d from b.
    normal[..., each, each] *= 1.0 + 1e-9
    normal[..., each, each] += precision
    return normal


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


def log_evidence(seen: Sequences, of: Rotated, ratios: Sequence[float]) -> Floats:
    """Return the log evidence of each variance ratio, (ratios, n); see `solve`."""
    y = seen.photos @ of.eigenvectors
    g = np.swapaxes(seen.known, -1, -2) @ of.eigenvectors
    variance = np.asarray(ratios)[:, None] * of.eigenvalues + 1.0
    weight = 1.0 / variance
    yy = weight @ (y**2).T
    gy = np.einsum("tk,ngk->tng", weight, g * y[:, None], optimize=True)
    gg = np.einsum("tk,nghk->tngh", weight, g[:, :, None] * g[:, None], optimize=True)
    gg = _regular(gg, seen.precision)
    found = np.linalg.solve(gg, gy[..., None])[..., 0]
    left = np.maximum(yy - np.einsum("tng,tng->tn", found, gy), np.finfo(np.float64).tiny)
    determinant = np.log(variance).sum(axis=1)[:, None] + np.linalg.slogdet(gg)[1]
    determinant -= seen.log_prior
    return np.asarray(-0.5 * (seen.free * np.log(left / seen.free) + determinant))
