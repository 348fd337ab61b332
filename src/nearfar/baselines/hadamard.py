"""Hadamard multiplexing: half of the projector lit in every photo.

The patterns are the rows of an S-matrix of order q (Harwit and Sloane 1979), used for illumination
by Schechner, Nayar and Belhumeur 2003. For a prime q = 3 mod 4 it has S[m, p] = s(m + p mod q),
where s is 1 at 0 and at the squares modulo q and 0 elsewhere, and

    S^-1 = 2 / (q + 1) (2 S^T - 1),

a circular correlation. With q at least P, the columns beyond P have no pixel to light.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import isqrt

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from nearfar.arrays import Floats, Size


@dataclass(frozen=True)
class Hadamard:
    """Black, then q patterns of an S-matrix: q + 1 photos.

    Under noise that does not grow with light, an entry of T has 4 / (q + 1) of the variance of a
    photo: 4 q / (q + 1)^2 from the patterns, the rest from black.

    Attributes
    ----------
    projector : Size
    """

    projector: Size
    name: str = "Hadamard"

    @cached_property
    def order(self) -> int:
        """Least prime q = 3 mod 4 with a column for every projector pixel."""
        q = self.projector.pixels + (3 - self.projector.pixels) % 4
        while not _is_prime(q):
            q += 4
        return q

    @property
    def photos(self) -> int:
        """Number of patterns q, and black."""
        return self.order + 1

    @cached_property
    def sequence(self) -> NDArray[np.uint8]:
        """Sequence s, shape (q,)."""
        s = np.zeros(self.order, dtype=np.uint8)
        s[np.arange(self.order, dtype=np.int64) ** 2 % self.order] = 1
        return s

    def patterns(self) -> Iterator[NDArray[np.uint8]]:
        """Draw black, then the rows of S."""
        yield np.zeros(self.projector, dtype=np.uint8)
        twice = np.concatenate([self.sequence, self.sequence]) * np.uint8(255)
        for m in range(self.order):
            yield twice[m : m + self.projector.pixels].reshape(self.projector)

    def decode(self, photos: Floats) -> Floats:
        """Correlate with 2 s - 1: (q + 1, I) to (I, P)."""
        responses = np.ascontiguousarray((photos[1:] - photos[0]).T, dtype=np.float64)
        signs = fft.rfft(2.0 * self.sequence - 1.0)
        rows = fft.irfft(signs * np.conj(fft.rfft(responses)), n=self.order)
        return np.asarray(rows[:, : self.projector.pixels] * (2.0 / (self.order + 1)))


def _is_prime(number: int) -> bool:
    return number > 1 and all(number % factor for factor in range(2, isqrt(number) + 1))
