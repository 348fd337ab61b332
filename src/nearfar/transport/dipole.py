"""Light that a translucent surface gives back about where it entered: a dipole of sources.

Jensen, Marschner, Levoy and Hanrahan, "A Practical Model for Subsurface Light Transport", SIGGRAPH
2001, section 2.2. Lengths are in one unit of the caller's, metres or projector pixels.
"""

from dataclasses import dataclass

import numpy as np

from nearfar.arrays import Floats


@dataclass(frozen=True)
class Dipole:
    """The two sources of one colour channel.

    Attributes
    ----------
    reduced_albedo : float
        alpha' = sigma_s' / (sigma_s' + sigma_a).
    attenuation : float
        sigma_tr, effective, per unit of length.
    real, virtual : float
        Depth of the real and height of the virtual source.
    """

    reduced_albedo: float
    attenuation: float
    real: float
    virtual: float


def boundary_mismatch(index: float) -> float:
    """Return A = (1 + R) / (1 - R), R being the diffuse Fresnel reflectance inside.

    R is Egan and Hilgeman's fit as quoted by Jensen et al.

    Parameters
    ----------
    index : float
        Refractive index relative to the outside.
    """
    reflectance = -1.440 / index**2 + 0.710 / index + 0.668 + 0.0636 * index
    return (1 + reflectance) / (1 - reflectance)


def diffuse_reflectance(source: Dipole, radius: Floats | float = np.inf) -> Floats:
    """Share of light that leaves within `radius` of where it entered a flat surface.

    The integral of R_d(r) 2 pi r up to the radius, in closed form.
    """
    radius = np.asarray(radius, dtype=float)
    total = np.zeros_like(radius)
    for depth in (source.real, source.virtual):
        far = np.hypot(radius, depth)
        total += np.exp(-source.attenuation * depth)
        total -= depth / far * np.exp(-source.attenuation * far)
    return source.reduced_albedo / 2 * total


def diffuse_profile(source: Dipole, square: Floats) -> Floats:
    """R_d at squared distances, per unit of area (Jensen et al., equation 4)."""
    total = np.zeros_like(square)
    for depth in (source.real, source.virtual):
        far = np.sqrt(square + depth**2)
        # Products, since a power of 3 takes many times as long.
        cube = far * far * far
        far *= -source.attenuation
        total += depth * (1 - far) / cube * np.exp(far)
    return source.reduced_albedo / (4 * np.pi) * total
