"""Cosines and sines about q: one set of patterns for every camera pixel.

Responses whose phases are shifted to a camera pixel's own place meet patterns that are drawn about
that place, and these are the same at every camera pixel.

Index convention: r runs over real responses, w over the W x W offsets of a window from the rounded
q, row by row. The window of an odd W reaches (W-1)/2 to each side, that of an even W from -W/2 to
W/2 - 1.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Complexes, Floats, Size
from nearfar.illumination.real_basis import RealBasis


def window_offsets(window: int) -> NDArray[np.int64]:
    """Return the window's offsets (y, x) from the rounded q, shape (W^2, 2)."""
    side = np.arange(window) - window // 2
    y, x = np.meshgrid(side, side, indexing="ij")
    return np.stack([y.ravel(), x.ravel()], axis=1)


def reachable(window: int, projector: Size) -> NDArray[np.bool_]:
    """Return which offsets of a window lead from some projector pixel to another, shape (W^2,).

    On a projector of one row, those of the window's middle row alone.
    """
    found: NDArray[np.bool_] = np.all(np.abs(window_offsets(window)) < projector, axis=1)
    return found


# Offsets from the rounded q that the 2 x 2 footprint of direct light can touch.
FOOTPRINT_OFFSETS = window_offsets(3)


@dataclass(frozen=True, eq=False)
class CentredBasis:
    """Cosines and sines of chosen frequencies in coordinates re-centred on q.

    Attributes
    ----------
    basis : RealBasis
    response_indices : ndarray of int, shape (R,)
        Indices of its responses among those of the measurements.
    on_window : ndarray, shape (R, W^2), float32
        Patterns over the window.
    on_footprint : ndarray, shape (R, 9), float32
        Patterns over `FOOTPRINT_OFFSETS`.
    """

    basis: RealBasis
    response_indices: NDArray[np.int64]
    on_window: Floats
    on_footprint: Floats

    @cached_property
    def side_waves(self) -> tuple[Complexes, Complexes]:
        """exp(j 2 pi k y) and exp(j 2 pi k x) over differences of entries, each (K, 2 W - 1)."""
        window = round(np.sqrt(self.on_window.shape[1]))
        side = np.arange(1 - window, window)
        down, across = (
            np.exp(2j * np.pi * self.basis.cycles[:, axis, None] * side) for axis in (0, 1)
        )
        return down, across

    def put(self, move: Callable[[Any], Any]) -> "CentredBasis":
        """Put the patterns onto a device."""
        return replace(self, on_window=move(self.on_window), on_footprint=move(self.on_footprint))

    def recentre(self, responses: Floats, centres: NDArray[np.int64]) -> Floats:
        """Shift responses (n, channels, R) to centres (n, 2); see `RealBasis.recentre`."""
        return self.basis.recentre(responses, centres)

    def uncentre(self, responses: Floats, centres: NDArray[np.int64]) -> Floats:
        """Inverse of `recentre`."""
        return self.basis.uncentre(responses, centres)


def centred_basis(basis: RealBasis, offsets: NDArray[np.int64]) -> CentredBasis:
    """Draw a basis about q.

    Parameters
    ----------
    basis : RealBasis
    offsets : ndarray of int, shape (W^2, 2)
        Where `on_window` is drawn, by `window_offsets`.

    Returns
    -------
    CentredBasis
        Its response indices are those of the basis itself.
    """
    return CentredBasis(
        basis,
        np.arange(basis.count),
        basis.patterns_at(offsets),
        basis.patterns_at(FOOTPRINT_OFFSETS),
    )
