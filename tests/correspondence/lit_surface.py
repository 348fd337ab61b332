"""A camera that looks at surfaces under a large projector: responses by formula, without patterns.

Index convention: c runs over camera pixels, k over frequencies.
"""

from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Complexes, Floats, Size
from nearfar.illumination.frequencies import DC, Frequency, representatives, wrap
from nearfar.illumination.real_basis import RealBasis, real_basis
from nearfar.photometry.measurements import Measurements


class LitSurface(NamedTuple):
    """Measurements, and what is true of each camera pixel.

    Attributes
    ----------
    measurements : Measurements
    q : ndarray, shape (Cy, Cx, 2)
    lit : ndarray of bool, shape (Cy, Cx)
        False in a shadow, whose light is near- and far-range.
    """

    measurements: Measurements
    q: Floats
    lit: Booleans


def screen_frequencies(projector: Size) -> list[Frequency]:
    """Return about 110 frequencies, all whole cycles per screen.

    All up to 6 cycles, a sparse grid up to 36, and 15 more up to 0.4 cycles per projector pixel.
    """
    whole = [(y, x) for y in range(-6, 7) for x in range(-6, 7) if y * y + x * x <= 36]
    whole += [(y, x) for y in range(-36, 37, 9) for x in range(-36, 37, 9)]
    for number, share in enumerate(np.linspace(0, 1, 15)):
        y, x = (36 ** (1 - share) * (0.4 * side) ** share for side in projector)
        angle = np.pi * (0.618 * number % 1.0)
        whole.append((round(y * np.sin(angle)), round(x * np.cos(angle))))
    height, width = projector
    return representatives([wrap(Fraction(y, height), Fraction(x, width)) for y, x in whole])


def two_surfaces(projector: Size, camera: Size) -> Floats:
    """Return q of a curved surface, and of another in front of part of it: (Cy, Cx, 2)."""
    v, u = np.meshgrid(*(np.linspace(0, 1, side) for side in camera), indexing="ij")
    y = 0.04 + 0.9 * v + 0.03 * np.sin(5 * u + 1) * np.cos(3 * v) - 0.02 * v * u
    x = 0.04 + 0.85 * u + 0.03 * np.cos(4 * v) * np.sin(3 * u + 0.5) + 0.02 * u * v
    front = in_front(camera)
    q = np.stack([y - 0.01 * front, x + 0.05 * front], axis=-1)
    return np.asarray(q * (np.array(projector) - 1))


def in_front(camera: Size) -> Booleans:
    """Return where the other surface of `two_surfaces` is in front."""
    v, u = np.meshgrid(*(np.linspace(0, 1, side) for side in camera), indexing="ij")
    return np.asarray((u > 0.5) & (u < 0.75) & (v > 0.2) & (v < 0.75))


def in_shadow(camera: Size) -> Booleans:
    """Return where a shadow may be, beside the surface in front."""
    v, u = np.meshgrid(*(np.linspace(0, 1, side) for side in camera), indexing="ij")
    return np.asarray((u > 0.8) & (u < 0.93) & (v > 0.2) & (v < 0.75))


def lit_surface(
    projector: Size,
    camera: Size,
    *,
    q: Floats | None = None,
    shadow: Booleans | None = None,
    frequencies: Sequence[Frequency] | None = None,
    direct: tuple[float, float] = (0.5, 0.9),
    footprint: tuple[float, float] = (0.5, 3.0),
    noise: float = 0.011,
    channels: int = 1,
    seed: int = 0,
) -> LitSurface:
    """Answer sinusoids of a large projector.

    Parameters
    ----------
    projector, camera : Size
    q : ndarray, shape (Cy, Cx, 2), optional
        `two_surfaces` by default.
    shadow : ndarray of bool, shape (Cy, Cx), optional
        `in_shadow` by default.
    frequencies : sequence of Frequency, optional
        `screen_frequencies` by default.
    direct : tuple of float
        Least and largest share of white, from camera pixel to camera pixel. A tenth to a fifth, but
        at most half of the rest, is near-range light, which falls by e within 1 to 5 % of the
        projector's width about a place beside q; what remains is far-range light.
    footprint : tuple of float
        Least and largest standard deviation of direct light, in projector pixels.
    noise : float
        Standard deviation of a response, as a share of white.
    channels : int
    seed : int
    """
    generator = np.random.default_rng(seed)
    q = two_surfaces(projector, camera) if q is None else q
    shadow = in_shadow(camera) if shadow is None else shadow
    chosen = screen_frequencies(projector) if frequencies is None else frequencies
    basis = real_basis([DC, *(k for k in chosen if k != DC)], projector)
    cycles = basis.cycles
    share = _smooth(generator, camera, *direct)
    near_share = np.minimum(_smooth(generator, camera, 0.1, 0.2), (1 - share) / 2)
    width = np.exp(_smooth(generator, camera, *np.log(footprint)))
    reach = max(projector) * np.exp(_smooth(generator, camera, *np.log((0.01, 0.05))))
    place = q.reshape(-1, 2)
    beside = place + 0.3 * reach[:, None] * np.array([0.6, -0.8])
    rest = 1 - share - near_share
    responses = np.where(shadow.ravel(), 0, share)[:, None] * _on_pixels(place, width, cycles)
    responses += near_share[:, None] * _blob(beside, reach, cycles)
    for corner in generator.uniform(0, 1, size=(4, 2)):
        moved = corner + 0.1 * place / projector
        responses += rest[:, None] / 4 * _smooth_light(moved, basis)
    white = _smooth(generator, camera, 0.2, 0.9)[:, None] * np.ones(channels)
    real = np.where(basis.is_sine, -responses[:, basis.index].imag, responses[:, basis.index].real)
    measured = real[:, None] * white[..., None]
    measured += noise * white[..., None] * generator.normal(size=measured.shape)
    measurements = Measurements(
        camera=camera,
        basis=basis,
        responses=measured.astype(np.float32),
        noise=(noise * white).astype(np.float32),
        black=np.zeros_like(white, dtype=np.float32),
        quantisation_error=np.zeros((basis.count, 0), dtype=np.float32),
    )
    return LitSurface(measurements, q, ~shadow)


def _smooth(generator: np.random.Generator, camera: Size, least: float, most: float) -> Floats:
    """Return values that change slowly over the camera, (C,)."""
    v, u = np.meshgrid(*(np.linspace(0, 1, side) for side in camera), indexing="ij")
    a, b = generator.uniform(0, 2 * np.pi, size=2)
    waves = 0.5 + 0.3 * np.sin(7 * u + 5 * v + a) + 0.3 * np.cos(3 * u - 8 * v + b)
    return np.asarray(least + (most - least) * np.clip(waves, 0, 1)).ravel()


def _on_pixels(place: Floats, width: Floats, cycles: Floats) -> Complexes:
    """Answer a Gaussian that falls on whole projector pixels, each a square, (C, K).

    By Poisson's formula: aliases of the Gaussian's spectrum, each over a square's. Its centroid is
    `place` to a thousandth of a pixel from a width of half a pixel on.
    """
    answer = np.ones((len(place), len(cycles)), dtype=complex)
    for axis in range(2):
        total = 0.0
        for alias in (-1, 0, 1):
            k = cycles[:, axis] + alias
            kept = np.exp(-2 * np.pi**2 * np.outer(width**2, k**2)) * np.sinc(k)
            total = total + kept * np.exp(-2j * np.pi * (np.outer(place[:, axis], k) % 1.0))
        answer *= total
    return answer


def _blob(place: Floats, reach: Floats, cycles: Floats) -> Complexes:
    """Answer exp(-r / reach) about each place, (C, K)."""
    fall = (1 + (2 * np.pi * np.outer(reach, np.hypot(*cycles.T))) ** 2) ** -1.5
    return np.asarray(fall * np.exp(-2j * np.pi * ((place @ cycles.T) % 1.0)))


def _smooth_light(place: Floats, basis: RealBasis) -> Complexes:
    """Answer far-range light about each place, in shares of the screen, (C, K)."""
    across = basis.cycles * basis.projector
    fall = np.exp(-np.hypot(*across.T) / 2)
    return np.asarray(fall * np.exp(-2j * np.pi * ((place @ across.T) % 1.0)))
