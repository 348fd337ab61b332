"""A kind's expectation as the measured frequencies see it, the same for every camera pixel.

With n about q of covariance C and f stationary over the pattern grid, of power S, the responses to
the measured cosines and sines, re-centred on q, have the covariance K = B C B^T + diag(S), B the
patterns over the window. Measured m times over, in units of one measurement's noise, its
eigenvectors are those of sqrt(m) K sqrt(m), whatever the strength of the light and the noise.

Index convention: r runs over real responses, w over window entries, i over eigenvectors,
t over tabulated ratios.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.estimate.matrices import Band
from nearfar.transport.kinds import (
    Kind,
    NearCovariance,
    far_power,
    near_covariance,
    near_factors,
)

# Ratios of strength to noise, squared: from light far below the noise to photos without any.
RATIOS = 2.0 ** np.arange(-16.0, 41.0, 0.5)


@dataclass(frozen=True)
class Spectrum:
    """What tells how probable responses are under a kind.

    Attributes
    ----------
    levels : ndarray, shape (R,), float32
        Eigenvalues of sqrt(m) K sqrt(m), falling.
    directions : ndarray, shape (R, R), float32
        Its eigenvectors, times sqrt(m): from re-centred responses to their coordinates.
    of_corners : ndarray, shape (9, R), float32
        Coordinates of the responses of unit light at the entries around q.
    """

    levels: Floats
    directions: Floats
    of_corners: Floats

    def put(self, move: Callable[[Any], Any]) -> Self:
        """Put what each camera pixel meets onto a device."""
        values = {name: move(getattr(self, name)) for name in self._met}
        return replace(self, **values)

    @property
    def _met(self) -> tuple[str, ...]:
        return ("levels", "directions", "of_corners")


@dataclass(frozen=True)
class Prior(Spectrum):
    """One kind for one set of measured frequencies.

    Attributes
    ----------
    to_near : ndarray, shape (R, W^2), float32
        From weights of the eigenvectors to window entries.
    to_far : ndarray, shape (R, R), float32
        From weights of the eigenvectors to re-centred responses of f.
    of_window : ndarray, shape (W^2, R), float32
        Coordinates of the responses of unit light at each window entry.
    ratios : ndarray, shape (T,)
        (s / sigma)^2, for which is tabulated:
    curvatures : ndarray, shape (T, W^2), float32
        Information about a spike at each window entry, in units of one measurement's noise.
    shaken : ndarray, shape (T,)
        Mean variance of a window entry that noise causes, in units of one measurement's.
    factors : NearCovariance
    covariance : ndarray, shape (W^2, W^2), float64
        C.
    power : ndarray, shape (R,), float64
        S.
    """

    to_near: Floats
    to_far: Floats
    of_window: Floats
    ratios: Floats
    curvatures: Floats
    shaken: Floats
    factors: NearCovariance
    covariance: Floats
    power: Floats

    @property
    def _met(self) -> tuple[str, ...]:
        return (*super()._met, "to_near", "to_far", "of_window", "curvatures")

    def told_by(self, chosen: Integers, band: Band, multiplicity: Floats) -> Spectrum:
        """Return the spectrum of some responses alone."""
        patterns = band.on_window[chosen].astype(np.float64)
        matrix = patterns @ self.covariance @ patterns.T + np.diag(self.power[chosen])
        levels, directions = _decomposed(matrix, multiplicity[chosen])
        return Spectrum(
            levels=levels.astype(np.float32),
            directions=np.ascontiguousarray(directions, dtype=np.float32),
            of_corners=(band.on_corners[chosen].T @ directions).astype(np.float32),
        )


def _decomposed(matrix: Floats, multiplicity: Floats) -> tuple[Floats, Floats]:
    """Levels and directions of K, as `Spectrum` has them."""
    root = np.sqrt(multiplicity.astype(np.float64))
    levels, vectors = np.linalg.eigh(matrix * root[:, None] * root)
    return np.maximum(levels[::-1], 0.0), vectors[:, ::-1] * root[:, None]


def build_prior(kind: Kind, band: Band, multiplicity: Floats) -> Prior:
    """Build a kind's matrices.

    Parameters
    ----------
    kind : Kind
    band : Band
        The measured frequencies without DC.
    multiplicity : ndarray, shape (R,)
        m, how often each answer was measured.
    """
    patterns = band.on_window.astype(np.float64)
    window = round(np.sqrt(patterns.shape[1]))
    covariance = near_covariance(kind, window)
    seen = patterns @ covariance
    power = far_power(band.basis, kind)
    levels, directions = _decomposed(seen @ patterns.T + np.diag(power), multiplicity)
    to_near = directions.T @ seen
    of_window = directions.T @ patterns
    told = 1.0 / (RATIOS[:, None] * levels + 1.0)
    return Prior(
        levels=levels.astype(np.float32),
        directions=np.ascontiguousarray(directions, dtype=np.float32),
        to_near=np.ascontiguousarray(to_near, dtype=np.float32),
        to_far=np.ascontiguousarray(directions.T * power, dtype=np.float32),
        of_window=np.ascontiguousarray(of_window.T, dtype=np.float32),
        of_corners=np.ascontiguousarray(band.on_corners.T @ directions, dtype=np.float32),
        ratios=RATIOS,
        curvatures=(told @ of_window**2).astype(np.float32),
        shaken=(RATIOS[:, None] * told) ** 2 @ np.sum(to_near**2, axis=1) / to_near.shape[1],
        factors=near_factors(kind, window),
        covariance=covariance,
        power=power,
    )
