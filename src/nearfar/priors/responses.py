"""The responses to the measured frequencies under a prior component, for every camera pixel.

With n about q of covariance C and f stationary over the pattern grid, of variance S at each real
response, the responses to the measured cosines and sines, re-centred on q, have the covariance
K = B C B^T + diag(S), B the patterns over the window. Measured m times over, in units of one
measurement's noise, its eigenvectors are those of sqrt(m) K sqrt(m), whatever the prior scale and
the noise.

Index convention: r runs over real responses, w over window entries, i over eigenvectors,
t over tabulated variance ratios.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.illumination.centred_basis import CentredBasis
from nearfar.priors.component import PriorComponent
from nearfar.priors.covariance import (
    NearCovariance,
    covariance_of_coefficients,
    far_variance,
    near_covariance_factors,
)

# Variance ratios (s / sigma)^2, prior scale s over noise sigma, for which tables are made: from
# light far below the noise to photos without any.
VARIANCE_RATIOS = 2.0 ** np.arange(-16.0, 41.0, 0.5)


@dataclass(frozen=True, eq=False)
class Eigenbasis:
    """Eigenvalues and eigenvectors of the covariance of responses under a prior component.

    Attributes
    ----------
    eigenvalues : ndarray, shape (R,), float32
        Of sqrt(m) K sqrt(m), falling.
    eigenvectors : ndarray, shape (R, R), float32
        Of the same, times sqrt(m): from re-centred responses to their coordinates.
    of_footprint : ndarray, shape (9, R), float32
        Coordinates of the responses of unit light at each of `FOOTPRINT_OFFSETS`.
    """

    eigenvalues: Floats
    eigenvectors: Floats
    of_footprint: Floats

    def put(self, move: Callable[[Any], Any]) -> Self:
        """Put the arrays that every camera pixel is multiplied with onto a device."""
        values = {name: move(getattr(self, name)) for name in self._multiplied}
        return replace(self, **values)

    @property
    def _multiplied(self) -> tuple[str, ...]:
        return ("eigenvalues", "eigenvectors", "of_footprint")


@dataclass(frozen=True, eq=False)
class ResponsePrior(Eigenbasis):
    """One prior component for one set of measured frequencies.

    Attributes
    ----------
    to_near : ndarray, shape (R, W^2), float32
        From weights of the eigenvectors to window entries.
    to_far : ndarray, shape (R, R), float32
        From weights of the eigenvectors to re-centred responses of f.
    of_window : ndarray, shape (W^2, R), float32
        Coordinates of the responses of unit light at each window entry.
    variance_ratios : ndarray, shape (T,)
        (s / sigma)^2 of the tables that follow.
    spike_information : ndarray, shape (T, W^2), float32
        Fisher information about light at each window entry alone, in units of one measurement's
        noise.
    noise_gain : ndarray, shape (T,)
        Mean variance of an estimated window entry that noise causes, in units of one
        measurement's.
    response_gain : ndarray, shape (T,)
        Mean gain with which responses enter the estimate: 1 without noise.
    factors : NearCovariance
    covariance : ndarray, shape (W^2, W^2), float64
        C.
    far_variance : ndarray, shape (R,), float64
        S.
    """

    to_near: Floats
    to_far: Floats
    of_window: Floats
    variance_ratios: Floats
    spike_information: Floats
    noise_gain: Floats
    response_gain: Floats
    factors: NearCovariance
    covariance: Floats
    far_variance: Floats

    @property
    def _multiplied(self) -> tuple[str, ...]:
        return (*super()._multiplied, "to_near", "to_far", "of_window", "spike_information")

    def of_responses(
        self, selected: Integers, centred: CentredBasis, multiplicity: Floats
    ) -> Eigenbasis:
        """Return the eigenbasis of some of the responses."""
        patterns = centred.on_window[selected].astype(np.float64)
        matrix = patterns @ self.covariance @ patterns.T + np.diag(self.far_variance[selected])
        eigenvalues, eigenvectors = _eigenbasis(matrix, multiplicity[selected])
        return Eigenbasis(
            eigenvalues=eigenvalues.astype(np.float32),
            eigenvectors=np.ascontiguousarray(eigenvectors, dtype=np.float32),
            of_footprint=(centred.on_footprint[selected].T @ eigenvectors).astype(np.float32),
        )


def _eigenbasis(matrix: Floats, multiplicity: Floats) -> tuple[Floats, Floats]:
    """Return eigenvalues and scaled eigenvectors of K, as `Eigenbasis` has them."""
    root = np.sqrt(multiplicity.astype(np.float64))
    eigenvalues, vectors = np.linalg.eigh(matrix * root[:, None] * root)
    return np.maximum(eigenvalues[::-1], 0.0), vectors[:, ::-1] * root[:, None]


def response_prior(
    prior_component: PriorComponent, centred: CentredBasis, multiplicity: Floats
) -> ResponsePrior:
    """Build a prior component's matrices.

    Parameters
    ----------
    prior_component : PriorComponent
    centred : CentredBasis
        The measured frequencies without DC.
    multiplicity : ndarray, shape (R,)
        m, how often each response was measured.
    """
    patterns = centred.on_window.astype(np.float64)
    projector = centred.basis.projector
    covariance = covariance_of_coefficients(prior_component, centred.near_basis, projector)
    seen = patterns @ covariance
    variance = far_variance(centred.basis, prior_component)
    eigenvalues, eigenvectors = _eigenbasis(seen @ patterns.T + np.diag(variance), multiplicity)
    to_near = eigenvectors.T @ seen
    of_window = eigenvectors.T @ patterns
    precision = 1.0 / (VARIANCE_RATIOS[:, None] * eigenvalues + 1.0)
    shrinkage = VARIANCE_RATIOS[:, None] * precision
    return ResponsePrior(
        eigenvalues=eigenvalues.astype(np.float32),
        eigenvectors=np.ascontiguousarray(eigenvectors, dtype=np.float32),
        to_near=np.ascontiguousarray(to_near, dtype=np.float32),
        to_far=np.ascontiguousarray(eigenvectors.T * variance, dtype=np.float32),
        of_window=np.ascontiguousarray(of_window.T, dtype=np.float32),
        of_footprint=np.ascontiguousarray(centred.on_footprint.T @ eigenvectors, dtype=np.float32),
        variance_ratios=VARIANCE_RATIOS,
        spike_information=(precision @ of_window**2).astype(np.float32),
        noise_gain=shrinkage**2 @ np.sum(to_near**2, axis=1) / to_near.shape[1],
        response_gain=np.mean(shrinkage * eigenvalues, axis=1),
        factors=near_covariance_factors(prior_component, centred.near_basis.window, projector),
        covariance=covariance,
        far_variance=variance,
    )
