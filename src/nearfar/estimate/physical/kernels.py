"""Light under a surface as a kernel over projector pixels.

A kernel is the dipole of Jensen et al. (2001), integrated over the projector pixel that is lit and
over a smaller area about the place that is seen. On a slanted surface the distance between two
places is longer along the slope than on the projector: |r|^2 + (g . r)^2, where g is the slope of
depth, in projector pixels a projector pixel.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from nearfar.arrays import Floats
from nearfar.transport.dipole import Dipole, boundary_mismatch, diffuse_profile

# Waxes, marbles, skin and milk have 1.3 to 1.5.
REFRACTIVE_INDEX = 1.4
# Samples of a projector pixel on each side.
SAMPLES = 5
# Side of the area that is seen, in projector pixels. An estimate takes some of the fastest waves of
# light under a surface for direct light. With a whole projector pixel, sources that are too deep
# fit that, and direct light is too bright (docs/decisions/0123).
SEEN_SIDE = 0.71

Slope = tuple[float, float]
FLAT: Slope = (0.0, 0.0)


def slopes(steepest: Sequence[float], directions: int) -> tuple[Slope, ...]:
    """Return a flat surface and slopes of some steepness in directions over half a turn."""
    turns = np.pi * np.arange(directions) / directions
    steep = [(float(g * np.sin(t)), float(g * np.cos(t))) for g in steepest for t in turns]
    return (FLAT, *steep)


def source_at(depth: float, attenuation: float) -> Dipole:
    """Return the dipole of a real source at a depth, both in projector pixels, of unit albedo."""
    ratio = 1 + 4 * boundary_mismatch(REFRACTIVE_INDEX) / 3
    return Dipole(reduced_albedo=1.0, attenuation=attenuation, real=depth, virtual=ratio * depth)


def enlarged(source: Dipole, factor: float) -> Dipole:
    """Return a dipole whose lengths are in a unit of 1/factor of those it has."""
    return replace(
        source,
        attenuation=source.attenuation / factor,
        real=source.real * factor,
        virtual=source.virtual * factor,
    )


def kernel(source: Dipole, radius: int, slope: Slope = FLAT, samples: int = SAMPLES) -> Floats:
    """Return a dipole over (2 radius + 1)^2 projector pixels about q.

    Parameters
    ----------
    source : Dipole
        Lengths in projector pixels.
    radius : int
    slope : (float, float)
        Slope of depth down and across.
    samples : int
        On each side of a projector pixel.

    Returns
    -------
    ndarray, shape (2 radius + 1, 2 radius + 1), float64
    """
    over_pixels, profile = (
        _over_pixels(radius, samples),
        _upper_half(source, radius, slope, samples),
    )
    half = over_pixels[:, : len(profile)] @ profile @ over_pixels.T
    # The same half a turn about q.
    return np.asarray(half + half[::-1, ::-1])


def _upper_half(source: Dipole, radius: int, slope: Slope, samples: int) -> Floats:
    """Return a dipole at samples above q, and half of it beside q."""
    profile = diffuse_profile(source, _squared_distances(radius, slope, samples))
    profile[-1] /= 2
    return profile


@lru_cache(maxsize=32)
def _squared_distances(radius: int, slope: Slope, samples: int) -> Floats:
    """Return squared distances from q of samples above it and beside it, along the surface."""
    reach = (radius + 1) * samples
    side = np.arange(-reach, reach + 1) / samples
    y, x = np.meshgrid(side[: reach + 1], side, indexing="ij")
    square = y**2 + x**2 + (slope[0] * y + slope[1] * x) ** 2
    square.flags.writeable = False
    return np.asarray(square)


@lru_cache(maxsize=4)
def _over_pixels(radius: int, samples: int) -> Floats:
    """Return weights of samples in integrals over both areas along an axis, (2 radius + 1, n)."""
    pixel = np.full(samples, 1 / samples)
    from_middle = np.abs(np.arange(samples) - (samples - 1) / 2)
    seen = np.clip(SEEN_SIDE * samples / 2 - from_middle + 0.5, 0.0, 1.0)
    both = np.convolve(pixel, seen / seen.sum())
    weights = np.zeros((2 * radius + 1, 2 * (radius + 1) * samples + 1))
    for number, row in enumerate(weights):
        first = number * samples + 1
        row[first : first + len(both)] = both
    return weights
