"""Far-range transport: a few low frequencies, in real arithmetic.

A row of F is f(p) = (1/P) sum_k b_k exp(j 2 pi k.p). Its coefficients are kept as the real
answers to cosines and sines, b_k = (answer to cos) - j (answer to sin), one for a frequency
that is its own negative and two for a pair +-k, which share them.

Index convention: m runs over the real coefficients, cosine before sine for each k.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size
from nearfar.illumination.frequencies import Frequency
from nearfar.illumination.patterns import phase


@dataclass(frozen=True)
class RealBasis:
    """Cosines and sines of chosen frequencies on the pattern grid.

    Attributes
    ----------
    frequencies : tuple of Frequency
        One of each +-k.
    projector : Size
    """

    frequencies: tuple[Frequency, ...]
    projector: Size

    @cached_property
    def index(self) -> NDArray[np.int64]:
        """Frequency of each coefficient, shape (M,)."""
        return np.array(
            [i for i, k in enumerate(self.frequencies) for _ in range(self._parts(k))],
            dtype=np.int64,
        )

    @cached_property
    def is_sine(self) -> NDArray[np.bool_]:
        """Which coefficients answer a sine, shape (M,)."""
        return np.array(
            [sine for k in self.frequencies for sine in (False, True)[: self._parts(k)]],
            dtype=bool,
        )

    @staticmethod
    def _parts(frequency: Frequency) -> int:
        return 1 if frequency.is_own_negative else 2

    @property
    def count(self) -> int:
        """Number of real coefficients M."""
        return len(self.index)

    @cached_property
    def weights(self) -> NDArray[np.float64]:
        """1/P, or 2/P for a pair +-k: what the inverse DFT gives each coefficient, (M,)."""
        parts = np.array([self._parts(k) for k in self.frequencies], dtype=np.float64)
        return np.asarray(parts[self.index] / self.projector.pixels)

    @cached_property
    def patterns(self) -> NDArray[np.float32]:
        """cos(2 pi k.p) or sin(2 pi k.p), shape (M, P)."""
        drawn = np.empty((self.count, self.projector.pixels), dtype=np.float32)
        for m, (i, sine) in enumerate(zip(self.index, self.is_sine, strict=True)):
            angle = 2 * np.pi * phase(self.frequencies[i], self.projector).ravel()
            drawn[m] = np.sin(angle) if sine else np.cos(angle)
        return drawn

    def analyse(self, light: Floats) -> Floats:
        """Return weights times the light's overlap with each pattern: (..., P) to (..., M)."""
        kind = np.result_type(light.dtype, np.float32)
        overlaps = light.astype(kind, copy=False) @ self.patterns.T.astype(kind, copy=False)
        return np.asarray(overlaps * self.weights)

    def synthesise(self, coefficients: Floats) -> Floats:
        """Adjoint of `analyse`, and the rows of F: (..., M) to (..., P)."""
        kind = np.result_type(coefficients.dtype, np.float32)
        weighted = coefficients * self.weights.astype(kind)
        return np.asarray(weighted @ self.patterns.astype(kind, copy=False))


def real_basis(frequencies: Sequence[Frequency], projector: Size) -> RealBasis:
    """Return the cosines and sines of frequencies of which each stands for +-k."""
    return RealBasis(tuple(frequencies), projector)
