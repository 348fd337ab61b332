"""Brute force: one projector pixel at a time."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size


@dataclass(frozen=True)
class BruteForce:
    """Black, then each projector pixel alone at full white: P + 1 photos.

    The variance of an entry of T is that of two photos.

    Attributes
    ----------
    projector : Size
    """

    projector: Size
    name: str = "brute force"

    @property
    def photos(self) -> int:
        """Number of projector pixels P, and black."""
        return self.projector.pixels + 1

    def patterns(self) -> Iterator[NDArray[np.uint8]]:
        """Draw black, then one lit pixel after the other, row by row."""
        yield np.zeros(self.projector, dtype=np.uint8)
        for p in range(self.projector.pixels):
            pattern = np.zeros(self.projector.pixels, dtype=np.uint8)
            pattern[p] = 255
            yield pattern.reshape(self.projector)

    def decode(self, photos: Floats) -> Floats:
        """Subtract black: (P + 1, I) to (I, P)."""
        return np.asarray((photos[1:] - photos[0]).T)
