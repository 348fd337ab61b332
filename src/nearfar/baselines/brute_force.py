"""Brute force: one projector pixel at a time."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size


@dataclass(frozen=True)
class BruteForce:
    """Black, then each projector pixel alone at full white: P + 1 photos.

    The variance of an entry of T is that of two photos. The error of black is in every entry, so
    that under white it counts P times: more than one black lowers it.

    Attributes
    ----------
    projector : Size
    blacks : int
        Photos of black.
    """

    projector: Size
    blacks: int = 1
    name: str = "brute force"

    @property
    def photos(self) -> int:
        """Number of projector pixels P, and of blacks."""
        return self.projector.pixels + self.blacks

    def patterns(self) -> Iterator[NDArray[np.uint8]]:
        """Draw black, then one lit pixel after the other, row by row."""
        for _ in range(self.blacks):
            yield np.zeros(self.projector, dtype=np.uint8)
        for p in range(self.projector.pixels):
            pattern = np.zeros(self.projector.pixels, dtype=np.uint8)
            pattern[p] = 255
            yield pattern.reshape(self.projector)

    def decode(self, photos: Floats) -> Floats:
        """Subtract the mean black: (P + blacks, I) to (I, P)."""
        black = photos[: self.blacks].mean(axis=0)
        return np.asarray((photos[self.blacks :] - black).T)
