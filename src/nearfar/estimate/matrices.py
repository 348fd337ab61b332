"""What every camera pixel shares: patterns over the window, their inverse, what no photo sees."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size, namespace
from nearfar.illumination.frequencies import (
    CHECKERBOARD,
    Frequency,
    far_frequencies,
    grid,
    near_frequencies,
    representatives,
)
from nearfar.illumination.real_basis import RealBasis, real_basis
from nearfar.photometry.measurements import Measurements
from nearfar.transport import near

# Window offsets that the direct light's 2 x 2 footprint can touch.
CORNERS = np.array([(y, x) for y in (-1, 0, 1) for x in (-1, 0, 1)])


@dataclass(frozen=True)
class Band:
    """A set of measured frequencies and its patterns in re-centred coordinates.

    Attributes
    ----------
    basis : RealBasis
    places : ndarray, shape (R,)
        Where its responses stand among the measurements.
    on_window : ndarray, shape (R, W^2), float32
    on_corners : ndarray, shape (R, 9), float32
        Over `CORNERS`.
    """

    basis: RealBasis
    places: NDArray[np.int64]
    on_window: Floats
    on_corners: Floats

    def put(self, move: Callable[[Any], Any]) -> "Band":
        """Put the patterns onto a device."""
        return replace(self, on_window=move(self.on_window), on_corners=move(self.on_corners))

    def recentre(self, responses: Floats, centres: NDArray[np.int64]) -> Floats:
        """Turn responses (n, channels, R) about each pixel's centre (n, 2)."""
        return self.basis.recentre(responses, centres)

    def uncentre(self, responses: Floats, centres: NDArray[np.int64]) -> Floats:
        """Inverse of `recentre`."""
        return self.basis.uncentre(responses, centres)


def corner_weights(correspondence: Floats, centres: NDArray[np.int64]) -> Floats:
    """Weights over `CORNERS` of direct light at q, and what moving q down and across adds.

    Parameters
    ----------
    correspondence : ndarray, shape (n, 2)
        q; NaN where there is no direct light, which gets weights of 0.
    centres : ndarray, shape (n, 2)
        q rounded.

    Returns
    -------
    ndarray, shape (n, 3, 9), float32
        The bilinear footprint, and its derivatives by q; 0 along an axis on which q is whole.
    """
    xp = namespace(correspondence)
    lit = xp.all(xp.isfinite(correspondence), axis=1)
    off = xp.where(lit[:, None], correspondence - centres, 0.0)
    weights = xp.stack([xp.clip(-off, min=0.0), 1 - xp.abs(off), xp.clip(off, min=0.0)], axis=-1)
    sign = xp.sign(off)
    steps = xp.stack([xp.clip(sign, max=0.0), -sign, xp.clip(sign, min=0.0)], axis=-1)
    sides = ((weights, weights), (steps, weights), (weights, steps))
    found = [
        (of_y[:, 0, :, None] * of_x[:, 1, None, :]).reshape((len(off), 9)) for of_y, of_x in sides
    ]
    placed = xp.where(lit[:, None, None], xp.stack(found, axis=1), 0.0)
    weighed: Floats = xp.astype(placed, xp.float32)
    return weighed


def _band(measurements: Measurements, frequencies: Sequence[Frequency], window: int) -> Band:
    basis = real_basis(representatives(frequencies), measurements.projector)
    return replace(
        band_of(basis, near.offsets(window)), places=measurements.places(basis.frequencies)
    )


def band_of(basis: RealBasis, window_offsets: NDArray[np.int64]) -> Band:
    """Return a basis with its patterns about q; its responses stand in its own order."""
    return Band(
        basis, np.arange(basis.count), basis.patterns_at(window_offsets), basis.patterns_at(CORNERS)
    )


@dataclass(frozen=True)
class Matrices:
    """One set of matrices for every camera pixel.

    Attributes
    ----------
    window : int
    checkerboard, near, far : Band
    near_inverse : ndarray, shape (R_near, W^2), float32
        From near responses to the part of a window that they see.
    unseen : ndarray, shape (W^2, m), float32
        Orthonormal directions that no near photo sees: the dropped frequencies.
    near_leak : ndarray, shape (M, R_near), float32
        Responses of each far coefficient to the near patterns; 0 where W divides P.
    checkerboard_leak : ndarray, shape (M, 1), float32
        The same for the checkerboard; 0 where P is even.
    """

    window: int
    checkerboard: Band
    near: Band
    far: Band
    near_inverse: Floats
    unseen: Floats
    near_leak: Floats
    checkerboard_leak: Floats

    def put(self, move: Callable[[Any], Any]) -> "Matrices":
        """Put what each camera pixel meets onto a device."""
        bands = ("checkerboard", "near", "far")
        arrays = ("near_inverse", "unseen", "near_leak", "checkerboard_leak")
        moved = {name: getattr(self, name).put(move) for name in bands}
        return replace(self, **moved, **{name: move(getattr(self, name)) for name in arrays})


def build_matrices(measurements: Measurements, window: int, far: Size, dropped: Size) -> Matrices:
    """Build the paper's matrices.

    The patterns of the full near set are orthogonal over a window (equation 5), so the inverse
    is a scaled transpose, and what the dropped frequencies leave unseen is their own patterns.
    """
    far_band = _band(measurements, far_frequencies(far, measurements.projector), window)
    near_band = _band(measurements, near_frequencies(window, dropped), window)
    checkerboard = _band(measurements, [CHECKERBOARD], window)
    lowest = real_basis(
        representatives(grid(dropped, Size(window, window))), measurements.projector
    )
    unseen = lowest.patterns_at(near.offsets(window)).T.astype(np.float64)
    energy = np.sum(near_band.on_window.astype(np.float64) ** 2, axis=1)
    return Matrices(
        window,
        checkerboard,
        near_band,
        far_band,
        (near_band.on_window / energy[:, None]).astype(np.float32),
        (unseen / np.linalg.norm(unseen, axis=0)).astype(np.float32),
        _leak(far_band.basis, near_band.basis),
        _leak(far_band.basis, checkerboard.basis),
    )


def _leak(far: RealBasis, shown: RealBasis) -> Floats:
    """Responses of each far coefficient to the patterns of another basis, (M, R), float32."""
    overlap = far.patterns.astype(np.float64) @ shown.patterns.T.astype(np.float64)
    return np.asarray((far.weights[:, None] * overlap).astype(np.float32))
