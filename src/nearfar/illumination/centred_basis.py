"""Cosines and sines about q: one set of patterns for every camera pixel.

Responses whose phases are shifted to a camera pixel's own place meet patterns that are drawn about
that place, and these are the same at every camera pixel.

Index convention: r runs over real responses, w over the functions of a `NearBasis`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Complexes, Floats, product
from nearfar.illumination.near_basis import NearBasis, hat_response, window_offsets
from nearfar.illumination.real_basis import RealBasis

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
    near_basis : NearBasis
    on_window : ndarray, shape (R, J), float32
        Responses to the patterns of the functions of near-range light.
    on_footprint : ndarray, shape (R, 9), float32
        Patterns over `FOOTPRINT_OFFSETS`; (R, R), the unit matrix, where functions are of several
        projector pixels: footprints are then given by their responses.
    """

    basis: RealBasis
    response_indices: NDArray[np.int64]
    near_basis: NearBasis
    on_window: Floats
    on_footprint: Floats

    @cached_property
    def side_waves(self) -> tuple[Complexes, Complexes]:
        """exp(j 2 pi k y) and exp(j 2 pi k x) over differences of entries, each (K, 2 W - 1)."""
        window = self.near_basis.window
        side = np.arange(1 - window, window)
        down, across = (
            np.exp(2j * np.pi * self.basis.cycles[:, axis, None] * side) for axis in (0, 1)
        )
        return down, across

    def put(self, move: Callable[[Any], Any]) -> "CentredBasis":
        """Put the patterns onto a device."""
        return replace(self, on_window=move(self.on_window), on_footprint=move(self.on_footprint))

    def of_direct(self, weights: Floats) -> Floats:
        """Return re-centred responses (n, ..., R) of direct light, as weights of `on_footprint`."""
        return weights if self.near_basis.pitch > 1 else product(weights, self.on_footprint.T)

    def recentre(self, responses: Floats, centres: NDArray[np.int64]) -> Floats:
        """Shift responses (n, channels, R) to centres (n, 2); see `RealBasis.recentre`."""
        return self.basis.recentre(responses, centres)

    def uncentre(self, responses: Floats, centres: NDArray[np.int64]) -> Floats:
        """Inverse of `recentre`."""
        return self.basis.uncentre(responses, centres)


def centred_basis(basis: RealBasis, near_basis: NearBasis) -> CentredBasis:
    """Draw a basis about q.

    Parameters
    ----------
    basis : RealBasis
    near_basis : NearBasis

    Returns
    -------
    CentredBasis
        Its response indices are those of the basis itself.
    """
    return CentredBasis(
        basis,
        np.arange(basis.count),
        near_basis,
        _responses(basis, near_basis.offsets, near_basis.pitches),
        basis.patterns_at(FOOTPRINT_OFFSETS)
        if near_basis.pitch == 1
        else np.eye(basis.count, dtype=np.float32),
    )


def _responses(
    basis: RealBasis, offsets: NDArray[np.int64], pitches: NDArray[np.int64]
) -> NDArray[np.float32]:
    """Return the responses of hats at offsets (O, 2), shape (M, O)."""
    patterns = basis.patterns_at(offsets)
    if np.all(pitches == 1):
        return patterns
    return (patterns * hat_response(basis.cycles, pitches)[basis.index]).astype(np.float32)
