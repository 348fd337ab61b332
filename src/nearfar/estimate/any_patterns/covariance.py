"""Covariances of photos of any patterns, under prior components of a row about q.

A photo of pattern l is b + d l(q) + sum_w n_w l(w) + sum_r F_r lf_r, with b the black, n the window
about the rounded q and F the responses of far-range light, lf_r the sum of l with the function that
a unit of F_r is on the projector. At unit prior scale n has the covariance C and F the variances S,
so that the photos have the covariance

    A = L C L^T + Lf S Lf^T,

L the patterns over the window. Camera pixels of one rounded q share it.

Index convention: n runs over photos, w over window entries, r over real responses.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Integers, Size
from nearfar.illumination.frequencies import far_frequencies, representatives
from nearfar.illumination.near_basis import window_offsets
from nearfar.illumination.real_basis import RealBasis, real_basis
from nearfar.priors.component import PriorComponent
from nearfar.priors.covariance import (
    CORRELATION_LENGTH,
    far_variance,
    near_covariance_factors,
    smooth_covariance,
)

# Side of the band of frequencies that far-range light is kept at, on large pattern grids.
FAR_SIDE = 25
# Pattern grids of at most as many pixels keep all frequencies.
PIXELS_OF_ALL_FREQUENCIES = 1024
# Entries of a window whose deviation is below this share of that at q are left out.
LEAST_DEVIATION = 1e-3


@dataclass(frozen=True, eq=False)
class PatternModel:
    """Patterns, and the far-range light that they see.

    Attributes
    ----------
    patterns : ndarray, shape (N, P), float32
        Levels from 0 to 1.
    projector : Size
    window : int
        W.
    far_basis : RealBasis
        DC among it.
    of_far : ndarray, shape (N, R), float32
        Photos of unit responses of far-range light.
    """

    patterns: Floats
    projector: Size
    window: int
    far_basis: RealBasis
    of_far: Floats


def far_band(projector: Size) -> Size:
    """Return the band of frequencies that far-range light is kept at: one value for each."""
    side = FAR_SIDE if projector.pixels > PIXELS_OF_ALL_FREQUENCIES else max(projector)
    return Size(*(min(side, length) for length in projector))


def pattern_model(patterns: Floats, projector: Size, window: int) -> PatternModel:
    """Return the model of photos of patterns (N, P)."""
    basis = real_basis(representatives(far_frequencies(far_band(projector), projector)), projector)
    drawn = basis.patterns * basis.weights.astype(np.float32)[:, None]
    of_far = patterns.astype(np.float32) @ drawn.T
    return PatternModel(patterns.astype(np.float32), projector, window, basis, of_far)


def far_covariance(model: PatternModel, component: PriorComponent) -> Floats:
    """Return Lf S Lf^T at unit prior scale, (N, N), float64: the same for every camera pixel."""
    variance = far_variance(model.far_basis, component)
    weighed = model.of_far.astype(np.float64) * np.sqrt(variance)
    return np.asarray(weighed @ weighed.T)


@dataclass(frozen=True, eq=False)
class NearRoot:
    """A root of the covariance C of window entries that a component has light at.

    C = diag(deviation) (smooth x smooth + diag(independent)) diag(deviation), smooth along one axis
    and x the Kronecker product.

    Attributes
    ----------
    entries : ndarray of int, shape (w,)
        Of the W x W window, a square about q.
    deviation : ndarray, shape (w,), float64
    half : ndarray, shape (side, side), float64
        smooth = half half^T.
    rough : ndarray of int, shape (v,)
        Of `entries` those with a part that is independent of the others.
    rough_deviation : ndarray, shape (v,), float64
        Square root of that part.
    """

    entries: Integers
    deviation: Floats
    half: Floats
    rough: Integers
    rough_deviation: Floats

    def seen(self, over_window: Floats) -> Floats:
        """Return L root, (N, w + v), of patterns L over the whole window, (N, W^2)."""
        return self._times(over_window[:, self.entries])

    @cached_property
    def root(self) -> Floats:
        """C = root root^T: shape (w, w + v)."""
        return self._times(np.eye(len(self.entries)))

    def _times(self, over_entries: Floats) -> Floats:
        """Return values over the entries, (N, w), times the root, an axis at a time."""
        scaled, side = over_entries * self.deviation, len(self.half)
        across = scaled.reshape(-1, side) @ self.half
        turned = np.swapaxes(across.reshape(-1, side, side), 1, 2).reshape(-1, side)
        smooth = (turned @ self.half).reshape(len(scaled), -1)
        return np.concatenate([smooth, scaled[:, self.rough] * self.rough_deviation], axis=1)


def near_root(model: PatternModel, component: PriorComponent) -> NearRoot:
    """Return the root of the covariance of window entries at unit prior scale."""
    factors = near_covariance_factors(component, model.window, model.projector)
    largest = max(float(factors.deviation.max()), 1e-30)
    offsets = np.abs(window_offsets(model.window)).max(axis=1)
    reach = int(offsets[factors.deviation > LEAST_DEVIATION * largest].max(initial=0))
    entries = np.flatnonzero(offsets <= reach)
    values, vectors = np.linalg.eigh(smooth_covariance(CORRELATION_LENGTH, 2 * reach + 1))
    independent = factors.independent[entries]
    rough = np.flatnonzero(independent)
    return NearRoot(
        entries,
        factors.deviation[entries],
        vectors * np.sqrt(np.maximum(values, 0.0)),
        rough,
        np.sqrt(independent[rough]),
    )


def patterns_over_window(model: PatternModel, centre: NDArray[np.int64]) -> Floats:
    """Return the patterns over the window about one projector pixel, (N, W^2); 0 beyond it."""
    places = centre + window_offsets(model.window)
    inside = ((places >= 0) & (places < model.projector)).all(axis=1)
    flat = np.where(inside, places[:, 0] * model.projector.width + places[:, 1], 0)
    return np.asarray(model.patterns[:, flat] * inside)
