"""The medium that a body's camera pixels share, the slope of each, and how much light comes back.

At offsets o about q that have no direct light, a row is s S(o), where S is the kernel of the medium
on a surface of some slope, cut off where light falls beside the body. Two numbers of each channel
are fitted for the whole body: depth of the source and attenuation. With them shared, s and S(0)
are known where a camera pixel alone could not tell its subsurface light at q from direct light.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy import optimize

from nearfar.arrays import Booleans, Floats, Integers
from nearfar.estimate.physical.body import KERNEL_RADIUS, Body
from nearfar.estimate.physical.kernels import Slope, kernel, slopes, source_at
from nearfar.estimate.physical.rows_about import offsets
from nearfar.transport.dipole import Dipole

# Distances up to which rows are compared with the kernel.
COMPARED = 4.1
# Entries count by 1 / (S / S(0) + this): errors grow with the light, down to those of darkness.
DARK_ENTRY = 0.01
# Entries of projector pixels that light the body at least so far are compared.
LEAST_COVERAGE = 0.6
# First guesses of depth and attenuation.
DEPTHS = (0.5, 1.0, 2.0)
ATTENUATIONS = (0.15, 0.4, 1.0)
# Least and largest that rows about q can tell.
RANGES = ((0.2, 6.0), (0.02, 6.0))
# Camera pixels that the medium is fitted to, and how far a misfit may stand out from the median.
SAMPLE = 500
OUTLYING = 3.0
SLOPES = slopes((0.6, 1.3), 4)
# A slope must fit better than a flat surface by this factor.
FLAT_PREFERENCE = 0.9
ITERATIONS = 60


class Amplitudes(NamedTuple):
    """What a kernel makes of each row, shape (n,) each: its amplitude, and the misfit."""

    amplitude: Floats
    misfit: Floats


class Medium(NamedTuple):
    """One channel of a body.

    Attributes
    ----------
    source : Dipole
        Lengths in projector pixels.
    slope : ndarray of int, shape (n,)
        Which of `SLOPES` each camera pixel sees.
    amplitude : ndarray, shape (n,)
        s, of a kernel of unit albedo.
    explained : float
        Share of the weighed light about q that the kernel explains, 1 at best.
    """

    source: Dipole
    slope: Integers
    amplitude: Floats
    explained: float


def compared(body: Body) -> Booleans:
    """Return which entries tell of light under the surface alone, shape (n, O)."""
    distance = np.hypot(*offsets().T)
    covered = body.covered > LEAST_COVERAGE
    return np.asarray(~body.footprint & covered & (distance < COMPARED))


def _weights(body: Body, used: Booleans, source: Dipole) -> Floats:
    """Return the weights of entries, shape (n, O); 0 where they are not used."""
    flat = body.meet(kernel(source, KERNEL_RADIUS))
    return np.asarray(used / (flat / max(flat.max(), np.finfo(float).tiny) + DARK_ENTRY))


def _amplitudes(
    body: Body, rows: Floats, weights: Floats, source: Dipole, slope: Slope
) -> Amplitudes:
    """Fit the amplitude of one kernel in each row by weighted least squares."""
    shape = body.meet(kernel(source, KERNEL_RADIUS, slope))
    power = np.einsum("co,co,co->c", weights, shape, shape)
    overlap = np.einsum("co,co,co->c", weights, shape, rows)
    tiny = np.finfo(float).tiny
    amplitude = np.maximum(overlap / np.maximum(power, tiny), 0.0)
    misfit = np.einsum("co,co->c", weights, (rows - amplitude[:, None] * shape) ** 2)
    return Amplitudes(amplitude, misfit)


def medium_of(body: Body, channel: int) -> Medium:
    """Fit the medium of a body in one channel.

    Parameters
    ----------
    body : Body
    channel : int

    Returns
    -------
    Medium
    """
    rows = body.entries[:, channel].astype(np.float64)
    used = compared(body)

    def source_of(logarithms: Floats) -> Dipole:
        depth, attenuation = np.exp(np.clip(logarithms, *np.log(RANGES).T))
        return source_at(float(depth), float(attenuation))

    inner = np.flatnonzero(body.inner)
    chosen = np.random.default_rng(0).permutation(inner)[:SAMPLE]
    sample = _part(body, chosen)

    def misfit(logarithms: Floats) -> float:
        source = source_of(logarithms)
        weights = _weights(sample, used[chosen], source)
        found = _amplitudes(sample, rows[chosen], weights, source, SLOPES[0]).misfit
        return float(np.minimum(found, OUTLYING * np.median(found)).sum())

    starts = [np.log([depth, rate]) for depth in DEPTHS for rate in ATTENUATIONS]
    best = optimize.minimize(
        misfit,
        min(starts, key=misfit),
        method="Nelder-Mead",
        options={"maxiter": ITERATIONS, "xatol": 0.01, "fatol": 1e-9},
    )
    source = source_of(best.x)
    weights = _weights(body, used, source)
    of_slopes = [_amplitudes(body, rows, weights, source, slope) for slope in SLOPES]
    misfits = np.stack([body.share(one.misfit) for one in of_slopes])
    misfits[0] *= FLAT_PREFERENCE
    slope = misfits.argmin(axis=0)
    own = np.stack([one.amplitude for one in of_slopes])[slope, np.arange(len(slope))]
    # At the outline a camera pixel sees some of the body only.
    outline = np.minimum(own, np.median(own[body.inner]))
    shared = body.share(own, body.inner)
    left = misfits.min(axis=0)[body.inner].sum()
    light = np.einsum("co,co->c", weights, rows**2)[body.inner].sum()
    explained = 1.0 - left / light if light > 0 else 0.0
    return Medium(source, slope, np.where(body.inner, shared, outline), float(explained))


def _part(body: Body, chosen: Integers) -> Body:
    """Return a body of some of its camera pixels."""
    return replace(
        body,
        pixels=body.pixels[chosen],
        inner=body.inner[chosen],
        weights=body.weights[chosen],
        entries=body.entries[chosen],
        covered=body.covered[chosen],
    )
