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
from scipy import sparse

from nearfar.arrays import Floats, Integers, Size
from nearfar.illumination.near_basis import NearBasis
from nearfar.transport.widening import widen


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
        lit = bounds(light)
        if not light[lit].size:
            return levels.reshape(-1)
        placed = [slice(side.start + self.margin, side.stop + self.margin) for side in lit]
        levels[0][tuple(placed)] = light[lit]
        for narrow, wide, pitch in zip(levels, levels[1:], self.basis.rising_pitches, strict=False):
            # No farther than the hat carries light, which is next to nothing for a small spot.
            down, across = (slice(s.start - 2 * pitch, s.stop + 2 * pitch) for s in placed)
            widen(narrow, pitch, (down, across), wide)
        return levels.reshape(-1)

    def spread(self, levels: NDArray[Any]) -> Floats:
        """Adjoint of `levels`: (levels * rows * columns) to (Py, Px); changes them."""
        around = self.margin
        own = levels.reshape(self.shape)
        blurred, other = own[-1], np.empty_like(own[-1])
        pitches = self.basis.rising_pitches[:-1]
        for finer, pitch in zip(own[-2::-1], reversed(pitches), strict=True):
            widen(blurred, pitch, (slice(None), slice(None)), other)
            other += finer
            blurred, other = other, blurred
        return np.array(blurred[around:-around, around:-around])

    def scatter(self, near: Floats, places: Integers, image: Floats, levels: NDArray[Any]) -> None:
        """Add near-range light (n, J), times an image (n,), to `levels`, flat and float64.

        Parameters
        ----------
        near, image : ndarray
        places : ndarray of int, shape (n,)
            Of `places`; n is above 0.
        levels : ndarray, shape (levels * rows * columns,)
            Zero where nothing was added yet.
        """
        for pitch in self.basis.rising_pitches:
            mine = np.flatnonzero(self.basis.pitches == pitch)
            entries = places[:, None] + self.steps[mine]
            # Only the rows between the first and the last place are touched.
            first = int(entries.min())
            length = int(entries.max()) + 1 - first
            entries -= first
            # A column of this matrix is a camera pixel.
            columns = sparse.csc_array(
                (
                    near[:, mine[0] : mine[-1] + 1].astype(np.float32).ravel(),
                    entries.astype(np.int32).ravel(),
                    np.arange(0, entries.size + 1, len(mine), dtype=np.int32),
                ),
                shape=(length, len(places)),
            )
            levels[first : first + length] += columns @ image


def bounds(light: Floats) -> tuple[slice, slice]:
    """Return the rows and columns between the first and the last lit pixel."""
    found = []
    for axis in (1, 0):
        places = np.flatnonzero(light.any(axis=axis))
        found.append(slice(int(places[0]), int(places[-1]) + 1) if len(places) else slice(0, 0))
    return found[0], found[1]
