"""Responses as shares of white, each weighed by the inverse variance of all but direct light in it.

Index convention: c runs over camera pixels, i over channels, r over real responses, k over
frequencies.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.correspondence.background import Spectrum
from nearfar.errors import InputError
from nearfar.illumination.frequencies import DC
from nearfar.illumination.real_basis import RealBasis
from nearfar.photometry.measurements import Measurements

# White below this share of the brightest white is rounding.
LEAST_WHITE = 1e-6


class Weighed(NamedTuple):
    """Responses over white, channels summed by their weights.

    `responses` (C, R) are the sums of weight times response, `weights` (C, K) the sums of weights,
    one for both cosine and sine of a frequency.
    """

    responses: Floats
    weights: Floats


def without_dc(measurements: Measurements) -> RealBasis:
    """Return the measured frequencies but for DC.

    Raises
    ------
    InputError
        If there is no response to DC.
    """
    basis = measurements.basis
    if DC not in basis.frequencies:
        raise InputError(
            "the measurements have no response to white, of which direct light is a share: "
            "plan with a white photo."
        )
    return RealBasis(tuple(k for k in basis.frequencies if k != DC), basis.projector)


class RelativeResponses(NamedTuple):
    """Responses of some camera pixels over their own white.

    Attributes
    ----------
    responses : ndarray, shape (C, channels, R), float32
    variances : ndarray, shape (C, channels, K)
        Mean variance of the responses to the cosine and the sine of each frequency.
    """

    responses: Floats
    variances: Floats


class Division(NamedTuple):
    """Divides responses by white.

    Attributes
    ----------
    measurements : Measurements
    basis : RealBasis
        Frequencies of these, without DC, in any order.
    white : int
        Index of the response to white.
    indices : ndarray, shape (R,), int64
        Indices of the responses to the frequencies of `basis`.
    brightest : float
        Largest white of the whole camera.
    """

    measurements: Measurements
    basis: RealBasis
    white: int
    indices: Integers
    brightest: float

    def of_pixels(self, pixels: slice | Integers) -> RelativeResponses:
        """Return the relative responses of some camera pixels, in the order of `basis`."""
        responses = self.measurements.responses[pixels]
        white = responses[..., self.white]
        scale = np.maximum(white, LEAST_WHITE * self.brightest)
        inverse = np.divide(1.0, scale, where=scale > 0, out=np.zeros_like(scale))[..., None]
        variance = np.broadcast_to(self._variance(pixels), responses.shape)
        variance = variance[..., self.indices] * inverse**2
        return RelativeResponses(
            responses[..., self.indices] * inverse, _of_pairs(self.basis, variance)
        )

    def _variance(self, pixels: slice | Integers) -> Floats:
        """Return the variance of each response, broadcastable to (C, channels, R)."""
        measured = self.measurements
        references = measured.white_noise[pixels] ** 2 + measured.black_noise[pixels] ** 2
        repeated = measured.noise[pixels][..., None] ** 2 / measured.multiplicity
        return np.asarray(repeated + references[..., None])


def division_by_white(measurements: Measurements, basis: RealBasis) -> Division:
    """Prepare to divide responses by white.

    Parameters
    ----------
    measurements : Measurements
    basis : RealBasis
        Frequencies of these, without DC, in any order.
    """
    white = int(measurements.response_indices([DC])[0])
    brightest = measurements.brightest
    return Division(
        measurements,
        basis,
        white,
        measurements.response_indices(basis.frequencies),
        brightest or float(measurements.responses[..., white].max(initial=0.0)),
    )


def _of_pairs(basis: RealBasis, variance: Floats) -> Floats:
    """Return the mean over the cosine and the sine of each frequency, (C, channels, K)."""
    cosine = np.flatnonzero(~basis.is_sine)
    paired = np.diff(np.append(cosine, basis.count)) == 2
    total = variance[..., cosine]
    total[..., paired] += variance[..., cosine[paired] + 1]
    return np.asarray(total / (1 + paired))


def weigh(basis: RealBasis, relative: RelativeResponses, background: Spectrum) -> Weighed:
    """Weigh responses by the inverse variance of noise and background, and sum over channels."""
    # A cosine and its sine have the same weight, so that no place is favoured.
    weights = 1.0 / (relative.variances + background.spectral_density(basis))
    summed = np.einsum("cir,cir->cr", relative.responses, weights[..., basis.index])
    return Weighed(summed.astype(np.float32), weights.sum(axis=1).astype(np.float32))
