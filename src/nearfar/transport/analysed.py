"""A light analysed once for the transports of many blocks of camera pixels."""

from dataclasses import dataclass

import numpy as np

from nearfar.arrays import Floats
from nearfar.illumination.real_basis import RealBasis
from nearfar.transport.blurred import BlurredLight, blurred_light
from nearfar.transport.pyramid import Pyramid


@dataclass(frozen=True, eq=False)
class AnalysedLight:
    """A light, summed, blurred and transformed; made by `Transport.analyse`.

    Attributes
    ----------
    flat : ndarray, shape (1, P) or (channels, P)
        The light itself.
    overlaps : ndarray, shape (1, M) or (channels, M)
        With the basis of far-range light.
    blurred : tuple of BlurredLight
        One, or one for each channel; none where near-range light is made of single pixels.
    """

    flat: Floats
    overlaps: Floats
    blurred: tuple[BlurredLight, ...] = ()


def overlaps_of(lights: Floats, basis: RealBasis) -> Floats:
    """Return the overlaps of lights (..., P) with a basis, (..., M), in the lights' precision."""
    dtype = np.result_type(lights, np.float32)
    return basis.analyse(lights).astype(dtype, copy=False)


def analysed_light(flat: Floats, basis: RealBasis, pyramid: Pyramid | None) -> AnalysedLight:
    """Analyse a light (1 or channels, P); `pyramid` is None for single pixels."""
    blurred = () if pyramid is None else tuple(blurred_light(one, pyramid) for one in flat)
    return AnalysedLight(flat, overlaps_of(flat, basis), blurred)
