"""Covariances of a prior component: of window entries, and of far-range light's responses.

Index convention: r runs over real responses, w over window entries.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.illumination.near_basis import NearBasis, reachable, window_offsets
from nearfar.illumination.real_basis import RealBasis
from nearfar.priors.component import PriorComponent

# Length, in projector pixels, over which neighbouring window entries are correlated.
CORRELATION_LENGTH = 1.0
# At pitches of several projector pixels: the correlation length at q, in cells, its growth with
# distance, and the distance at which it has become `CORRELATION_LENGTH`.
LENGTH_AT_Q = 0.15
LENGTH_GROWTH = 0.85
LAST_SHARP = (CORRELATION_LENGTH - LENGTH_AT_Q) / LENGTH_GROWTH
# Floor of far-range light's spectral density, as a share of that at DC: sharp shadows have light
# at every frequency.
SPECTRAL_DENSITY_FLOOR = 1e-6


def spectral_density(cycles: Floats, prior_component: PriorComponent) -> Floats:
    """Return the mean square |b_k| of f at unit prior scale.

    Parameters
    ----------
    cycles : ndarray
        Distance of k from DC, in cycles per pattern grid.
    """
    falling = np.exp(-2 * cycles / prior_component.far_decay)
    if prior_component.far_power:
        falling = falling * (1 + cycles) ** (-2 * prior_component.far_power)
    return np.asarray(prior_component.far_deviation**2 * (falling + SPECTRAL_DENSITY_FLOOR))


def far_variance(basis: RealBasis, prior_component: PriorComponent) -> Floats:
    """Return the variance of each real response of f at unit prior scale, shape (R,), float64.

    The spectral density of a pair +-k is shared by its cosine and its sine.
    """
    cycles = basis.cycles * np.array(basis.projector)
    density = spectral_density(np.hypot(cycles[:, 0], cycles[:, 1]), prior_component)
    own = np.array([k.is_own_negative for k in basis.frequencies])
    return np.asarray((density * np.where(own, 1.0, 0.5))[basis.index])


class NearCovariance(NamedTuple):
    """C = diag(deviation) (smooth + diag(independent)) diag(deviation) over window entries.

    Attributes
    ----------
    deviation : ndarray, shape (W^2,), float64
    smooth : ndarray, shape (W, W), float64
        Along one axis: over the window it is the Kronecker product with itself.
    independent : ndarray, shape (W^2,), float64
    """

    deviation: Floats
    smooth: Floats
    independent: Floats


def smooth_covariance(length: float, entries: int) -> Floats:
    """Return exp(-(i - j)^2 / (2 length^2)) along one axis, shape (entries, entries), float64."""
    side = np.arange(entries)
    return np.asarray(np.exp(-((side[:, None] - side) ** 2) / (2 * length**2)))


def near_covariance_factors(
    prior_component: PriorComponent, window: int, projector: Size
) -> NearCovariance:
    """Return the factors of the covariance C of window entries at unit prior scale.

    All are 0 where the component has no near-range light. The deviation is 0 at entries that lie on
    the projector for no q: on one of a single row, those above and below q.
    """
    offsets = window_offsets(window).astype(np.float64)
    smooth = smooth_covariance(CORRELATION_LENGTH, window)
    if prior_component.near_reach == 0:
        nothing = np.zeros(len(offsets))
        return NearCovariance(nothing, smooth, nothing)
    deviation = np.exp(-np.hypot(offsets[:, 0], offsets[:, 1]) / prior_component.near_reach)
    around = np.abs(offsets).max(axis=1) <= 1
    spread = (prior_component.direct_spread / deviation) ** 2 * around
    deviation = deviation * reachable(window, projector)
    return NearCovariance(deviation, smooth, spread + prior_component.roughness**2)


def near_covariance(prior_component: PriorComponent, window: int, projector: Size) -> Floats:
    """Return the covariance C of window entries at unit prior scale, (W^2, W^2), float64."""
    deviation, smooth, independent = near_covariance_factors(prior_component, window, projector)
    middle = np.kron(smooth, smooth) + np.diag(independent)
    return np.asarray(deviation[:, None] * middle * deviation)


def covariance_of_coefficients(
    prior_component: PriorComponent, near_basis: NearBasis, projector: Size
) -> Floats:
    """Return the covariance of the coefficients of near-range light at unit prior scale, (J, J).

    `near_covariance` for single pixels. Else lengths count in cells of the coarsest pitch. Light
    next to q is correlated over shorter distances than that farther away, so that it may be as
    sharp as the finest functions.
    """
    if near_basis.pitch == 1:
        return near_covariance(prior_component, near_basis.window, projector)
    cells = near_basis.offsets / near_basis.pitch
    coarse = near_basis.window**2
    if prior_component.near_reach == 0:
        return np.zeros((len(cells), len(cells)))
    distance = np.hypot(cells[:, 0], cells[:, 1])
    deviation = np.exp(-distance / prior_component.near_reach)
    deviation *= np.all(np.abs(near_basis.offsets) < projector, axis=1)
    # Distances in correlation lengths, which grow up to a cell away from q.
    lengths = _correlation_lengths(distance)
    stretch = np.divide(lengths, distance, out=np.ones_like(lengths), where=distance > 0)
    warped = cells * stretch[:, None]
    apart = np.sum((warped[:, None] - warped) ** 2, axis=-1)
    densities = deviation[:, None] * np.exp(-apart / 2) * deviation
    covariance = near_basis.from_densities @ densities @ near_basis.from_densities.T
    around = np.flatnonzero(np.abs(cells[:coarse]).max(axis=1) <= 1)
    independent = (prior_component.roughness * deviation[:coarse]) ** 2
    independent[around] += prior_component.direct_spread**2
    covariance[np.arange(coarse), np.arange(coarse)] += independent
    return np.asarray(covariance)


def _correlation_lengths(distance: Floats) -> Floats:
    """Return distances from q, in cells, in units of the correlation length at every distance."""
    near = np.minimum(distance, LAST_SHARP)
    within = np.log1p(near * LENGTH_GROWTH / LENGTH_AT_Q) / LENGTH_GROWTH
    return np.asarray(within + np.maximum(distance - LAST_SHARP, 0.0) / CORRELATION_LENGTH)
