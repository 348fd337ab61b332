"""Measurements: the response of each camera pixel to each frequency, in photo units."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Integers, Size
from nearfar.illumination.frequencies import Frequency
from nearfar.illumination.real_basis import RealBasis


def _left_out() -> Floats:
    """Return an array without axes, which stands for a field that was not given."""
    return np.zeros((), dtype=np.float32)


@dataclass(frozen=True, eq=False)
class Measurements:
    """Responses of every camera pixel to cosines and sines without offset.

    Index convention: c runs over camera pixels row by row, r over the real responses of `basis`;
    b_k(c) = (response to cos) - j (response to sin).

    Attributes
    ----------
    camera : Size
    basis : RealBasis
        The frequencies that were measured, one of each +-k, and the pattern grid.
    responses : ndarray, shape (C, channels, R), float32
    noise : ndarray, shape (C, channels), float32
        Standard deviation of one real response from one measurement: a pair, or one photo against
        references; 0 where there is none.
    black : ndarray, shape (C, channels), float32
        The photo under black.
    quantisation_error : ndarray, shape (R, P), float32
        The 8-bit pattern less the ideal cosine or sine, as far as it holds frequencies that were
        not measured: what the others add to the responses is taken off them. 0 in theory.
    excess_of_sums : float
        By what share of white inverse pairs sum to more than white + black; 0 where projector
        and camera are linear, and by reference.
    multiplicity : ndarray, shape (R,), float32
        How often each response was measured: response r has noise / sqrt(multiplicity[r]). Ones
        by default.
    white_noise, black_noise : ndarray, shape (C, channels), float32
        Standard deviations of the white and the black that all sinusoids' responses were taken
        against: errors e_w and e_k of theirs add -(e_w + e_k) to every one of them. 0, the
        default, where each was taken against its own inverse, or by codes.
    light_noise : ndarray, shape (C, channels), float32
        Standard deviation of the response to DC, white - black, whatever its multiplicity; by
        default `noise`.
    brightest : float
        Largest response to DC of the whole camera, where these are some of its rows; by default 0:
        that of these rows.

    Examples
    --------
    >>> measurements.basis.count, measurements.responses.shape
    (18, (64, 1, 18))
    """

    camera: Size
    basis: RealBasis
    responses: Floats
    noise: Floats
    black: Floats
    quantisation_error: Floats
    excess_of_sums: float = 0.0
    multiplicity: Floats = field(default_factory=_left_out)
    white_noise: Floats = field(default_factory=_left_out)
    black_noise: Floats = field(default_factory=_left_out)
    light_noise: Floats = field(default_factory=_left_out)
    brightest: float = 0.0

    def __post_init__(self) -> None:
        defaults = {
            "multiplicity": np.ones(self.basis.count, dtype=np.float32),
            "white_noise": np.zeros_like(self.noise),
            "black_noise": np.zeros_like(self.noise),
            "light_noise": self.noise,
        }
        for name, values in defaults.items():
            if getattr(self, name).ndim == 0:
                object.__setattr__(self, name, values)

    @property
    def projector(self) -> Size:
        """Pattern grid."""
        return self.basis.projector

    @property
    def channels(self) -> int:
        """Number of camera channels."""
        return int(self.responses.shape[1])

    def response_indices(self, frequencies: Sequence[Frequency]) -> NDArray[np.int64]:
        """Return the indices of the responses to `frequencies`, cosine before sine."""
        return self.basis.response_indices(frequencies)

    def of_pixels(self, camera: Size, pixels: slice | Integers) -> "Measurements":
        """Return the measurements of some camera pixels, as a camera of size `camera`."""
        return replace(
            self,
            camera=camera,
            responses=self.responses[pixels],
            noise=self.noise[pixels],
            black=self.black[pixels],
            white_noise=self.white_noise[pixels],
            black_noise=self.black_noise[pixels],
            light_noise=self.light_noise[pixels],
        )


def join(parts: Sequence[Measurements]) -> Measurements:
    """Concatenate measurements of successive blocks of camera rows."""
    first = parts[0]
    if len(parts) == 1:
        return first
    height = sum(part.camera.height for part in parts)

    def joined(name: str) -> Floats:
        return np.concatenate([getattr(part, name) for part in parts])

    return replace(
        first,
        camera=Size(height, first.camera.width),
        excess_of_sums=max((part.excess_of_sums for part in parts), key=abs),
        responses=joined("responses"),
        noise=joined("noise"),
        black=joined("black"),
        white_noise=joined("white_noise"),
        black_noise=joined("black_noise"),
        light_noise=joined("light_noise"),
    )
