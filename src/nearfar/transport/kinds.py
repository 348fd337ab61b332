"""Kinds of camera pixel: what near- and far-range light is expected there before any photo.

A bare wall, wax and a crease differ by orders of magnitude, and no single Gaussian holds them
all. Each kind is one Gaussian of few numbers; which kind a camera pixel is, and how strong its
light, its own photos say (the evidence). The kinds were chosen one by one out of 240 (reach 0.8 to
6 pixels, decay 0.7 to 8 cycles, six shares, with and without spread), each time the one that
raised the evidence of camera pixels of the scenes cornell, cornell-aside, wedge and corner most;
docs/decisions/0010 has the figures.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats
from nearfar.illumination.real_basis import RealBasis
from nearfar.transport import near

# Neighbouring window entries answer alike over about this many projector pixels.
CORRELATION = 1.0
# Far-range light has at least this share of its power at every frequency: sharp shadows.
LEAST_POWER = 1e-6


class Kind(NamedTuple):
    """One Gaussian expectation of a row t about q, of unit strength.

    Attributes
    ----------
    reach : float
        Projector pixels over which the deviation of near-range light falls by e; 0: none.
    far : float
        Deviation of far-range light's DC over that of near-range light at q.
    decay : float
        Cycles per pattern grid over which the deviation of far-range light falls by e.
    spread : float
        Deviation, over that of near-range light at q, of direct light that does not lie as the
        2 x 2 footprint has it: independent on the 3 x 3 pixels around q.
    rough : float
        Deviation of window entries independent of each other, over that of the smooth part.
    """

    reach: float
    far: float
    decay: float
    spread: float = 0.0
    rough: float = 0.0


# In the order in which they were chosen.
LIT = (
    Kind(6.0, 256.0, 1.5),
    Kind(6.0, 16.0, 3.0),
    Kind(1.3, 1.0, 3.0),
    Kind(0.8, 64.0, 1.5),
    Kind(0.8, 64.0, 3.0),
    Kind(6.0, 64.0, 1.5),
    Kind(1.3, 256.0, 1.5),
    Kind(6.0, 64.0, 3.0),
    Kind(3.5, 16.0, 1.5),
    Kind(6.0, 64.0, 8.0),
    Kind(2.2, 16.0, 1.5, 3.0),
    Kind(0.8, 256.0, 3.0),
    Kind(1.3, 1.0, 1.5),
    Kind(0.8, 256.0, 0.7),
    Kind(2.2, 16.0, 1.5),
    Kind(6.0, 16.0, 8.0),
    Kind(2.2, 16.0, 0.7, 3.0),
    Kind(3.5, 4.0, 3.0),
    Kind(0.8, 1.0, 3.0),
    Kind(3.5, 16.0, 3.0),
    # Windows without any smoothness, added by hand: none of the scenes has them, but where photos
    # tell every entry they are to be believed.
    Kind(6.0, 1.0, 3.0, rough=1.0),
    Kind(6.0, 16.0, 3.0, rough=1.0),
    Kind(6.0, 64.0, 8.0, rough=1.0),
)
# Without direct light there is far-range light alone.
UNLIT = tuple(Kind(0.0, 64.0, decay) for decay in (0.7, 1.5, 3.0, 8.0))
# Deviations of near-range light at q that are tried, as shares of the camera pixel's white.
STRENGTHS = tuple(2e-4 * 2.0**step for step in range(11))


def far_power(basis: RealBasis, kind: Kind) -> Floats:
    """Power of each real answer of f at unit strength, shape (R,), float64."""
    cycles = basis.cycles * np.array(basis.projector)
    power = power_at(np.hypot(cycles[:, 0], cycles[:, 1]), kind)
    own = np.array([k.is_own_negative for k in basis.frequencies])
    return np.asarray((power * np.where(own, 1.0, 0.5))[basis.index])


def power_at(cycles: Floats, kind: Kind) -> Floats:
    """Mean square |b_k| of f at unit strength, as many cycles per pattern grid from DC."""
    return np.asarray(kind.far**2 * (np.exp(-2 * cycles / kind.decay) + LEAST_POWER))


class NearCovariance(NamedTuple):
    """C = diag(deviation) (smooth + diag(alone)) diag(deviation) over window entries.

    Attributes
    ----------
    deviation : ndarray, shape (W^2,), float64
    smooth : ndarray, shape (W, W), float64
        Along one axis: over the window it is the Kronecker product with itself.
    alone : ndarray, shape (W^2,), float64
    """

    deviation: Floats
    smooth: Floats
    alone: Floats


def smooth_side(correlation: float, entries: int) -> Floats:
    """Covariance of neighbouring window entries along one axis, (entries, entries), float64."""
    side = np.arange(entries)
    return np.asarray(np.exp(-((side[:, None] - side) ** 2) / (2 * correlation**2)))


def near_factors(kind: Kind, window: int) -> NearCovariance:
    """Factors of the covariance C of the window entries at unit strength; 0 without reach."""
    places = near.offsets(window).astype(np.float64)
    smooth = smooth_side(CORRELATION, window)
    if kind.reach == 0:
        nothing = np.zeros(len(places))
        return NearCovariance(nothing, smooth, nothing)
    deviation = np.exp(-np.hypot(places[:, 0], places[:, 1]) / kind.reach)
    around = np.abs(places).max(axis=1) <= 1
    return NearCovariance(
        deviation, smooth, (kind.spread / deviation) ** 2 * around + kind.rough**2
    )


def near_covariance(kind: Kind, window: int) -> Floats:
    """Covariance C of the window entries at unit strength, shape (W^2, W^2), float64."""
    deviation, smooth, alone = near_factors(kind, window)
    middle = np.kron(smooth, smooth) + np.diag(alone)
    return np.asarray(deviation[:, None] * middle * deviation)
