"""Measurements: what the photos say about each frequency, in photo units."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size
from nearfar.illumination.frequencies import Frequency
from nearfar.transport.far import RealBasis


@dataclass(frozen=True)
class Measurements:
    """Answers of every camera pixel to cosines and sines without offset.

    Index convention: c runs over camera pixels row by row, r over the real answers of `basis`;
    b_k(c) = (answer to cos) - j (answer to sin).

    Attributes
    ----------
    camera : Size
    basis : RealBasis
        The frequencies that were measured, one of each +-k, and the pattern grid.
    answers : ndarray, shape (C, channels, R), float32
    noise : ndarray, shape (C, channels), float32
        Standard deviation of one real answer; 0 where there is none.
    black : ndarray, shape (C, channels), float32
        The photo under black.
    shown_error : ndarray, shape (R, P), float32
        What was shown (8 bits) less the ideal cosine or sine; 0 in theory.
    excess_of_sums : float
        By what share of white inverse pairs sum to more than white + black; 0 where projector
        and camera are linear.
    """

    camera: Size
    basis: RealBasis
    answers: Floats
    noise: Floats
    black: Floats
    shown_error: Floats
    excess_of_sums: float = 0.0

    @property
    def projector(self) -> Size:
        """Pattern grid."""
        return self.basis.projector

    @property
    def channels(self) -> int:
        """Number of camera channels."""
        return int(self.answers.shape[1])

    def places(self, frequencies: Sequence[Frequency]) -> NDArray[np.int64]:
        """Places of the answers to `frequencies` along the last axis, cosine before sine."""
        order = {k: i for i, k in enumerate(self.basis.frequencies)}
        wanted = [order[k] for k in frequencies]
        found = [np.flatnonzero(self.basis.index == i) for i in wanted]
        return np.concatenate(found) if found else np.empty(0, dtype=np.int64)

    def of_pixels(self, camera: Size, pixels: slice) -> "Measurements":
        """Return the measurements of some camera pixels, as a camera of size `camera`."""
        return replace(
            self,
            camera=camera,
            answers=self.answers[pixels],
            noise=self.noise[pixels],
            black=self.black[pixels],
        )
