"""Lights blurred by the hats of a near basis, for every whole projector pixel.

What a camera pixel sees of a light by a hat of some pitch is a value of the light that is blurred
by that hat, so near-range light is a sum of a few such values.

Index convention: c runs over camera pixels, w over the functions of the basis; levels are the
pitches of the basis, rising from 1.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from nearfar.arrays import Floats, Integers, Size
from nearfar.illumination.near_basis import NearBasis


@dataclass(frozen=True, eq=False)
class Pyramid:
    """Where the functions of a basis about q read blurred lights.

    Attributes
    ----------
    basis : NearBasis
    projector : Size
    """

    basis: NearBasis
    projector: Size

    @property
    def margin(self) -> int:
        """Projector pixels by which every level is wider than the projector on each side."""
        return self.basis.reach + 1

    @cached_property
    def shape(self) -> tuple[int, int, int]:
        """Levels, and rows and columns of each."""
        height, width = self.projector
        around = 2 * self.margin
        return (len(self.basis.rising_pitches), height + around, width + around)

    @cached_property
    def steps(self) -> Integers:
        """Steps in flat levels from the rounded q in the first level to each function, (J,)."""
        level = np.log2(self.basis.pitches).astype(np.int64)
        _, height, width = self.shape
        return np.asarray(level * height * width + self.basis.offsets @ np.array([width, 1]))

    def places(self, centres: NDArray[np.int64]) -> Integers:
        """Return the rounded q in the flat first level, shape (C,)."""
        width = self.shape[2]
        return np.asarray((centres + self.margin) @ np.array([width, 1]))

    def levels(self, light: Floats) -> Floats:
        """Blur a light (Py, Px) by the hat of each pitch, flat; dark beyond the border."""
        levels = np.zeros(self.shape, dtype=light.dtype)
        around = self.margin
        inner = (slice(around, -around), slice(around, -around))
        for level, pitch in zip(levels, self.basis.rising_pitches, strict=True):
            level[inner] = light
            _blur(level, pitch)
        return levels.reshape(-1)

    def spread(self, levels: NDArray[Any]) -> Floats:
        """Adjoint of `levels`: (levels * rows * columns) to (Py, Px)."""
        around = self.margin
        found = np.zeros(self.projector)
        for level, pitch in zip(levels.reshape(self.shape), self.basis.rising_pitches, strict=True):
            blurred = level.copy()
            _blur(blurred, pitch)
            found += blurred[around:-around, around:-around]
        return found


def _blur(level: Floats, pitch: int) -> None:
    """Blur an array by a hat with a sum of 1, in place: two boxes of `pitch` along each axis."""
    if pitch == 1:
        return
    for axis in (0, 1):
        for origin in (0, -1 if pitch % 2 == 0 else 0):
            ndimage.uniform_filter1d(
                level, pitch, axis=axis, output=level, mode="constant", origin=origin
            )
