"""The paper's matrices, the same for every camera pixel.

Patterns over the window, their inverse, and what the dropped frequencies leave unseen of a window.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.illumination.centred_basis import CentredBasis, centred_basis
from nearfar.illumination.frequencies import (
    CHECKERBOARD,
    Frequency,
    far_frequencies,
    grid,
    near_frequencies,
    representatives,
)
from nearfar.illumination.near_basis import NearBasis, window_offsets
from nearfar.illumination.real_basis import RealBasis, real_basis
from nearfar.photometry.measurements import Measurements


def _centred(
    measurements: Measurements, frequencies: Sequence[Frequency], window: int
) -> CentredBasis:
    basis = real_basis(representatives(frequencies), measurements.projector)
    return replace(
        centred_basis(basis, NearBasis(window)),
        response_indices=measurements.response_indices(basis.frequencies),
    )


@dataclass(frozen=True, eq=False)
class Matrices:
    """One set of matrices for every camera pixel.

    Attributes
    ----------
    window : int
    checkerboard, near, far : CentredBasis
    near_inverse : ndarray, shape (R_near, W^2), float32
        From near responses to the part of a window that the near patterns see.
    unseen : ndarray, shape (W^2, m), float32
        Orthonormal directions that no near photo sees: the dropped frequencies.
    near_leak : ndarray, shape (M, R_near), float32
        Responses of each far coefficient to the near patterns; 0 where W divides P.
    checkerboard_leak : ndarray, shape (M, 1), float32
        The same for the checkerboard; 0 where P is even.
    """

    window: int
    checkerboard: CentredBasis
    near: CentredBasis
    far: CentredBasis
    near_inverse: Floats
    unseen: Floats
    near_leak: Floats
    checkerboard_leak: Floats

    def put(self, move: Callable[[Any], Any]) -> "Matrices":
        """Put the matrices onto a device."""
        bases = ("checkerboard", "near", "far")
        arrays = ("near_inverse", "unseen", "near_leak", "checkerboard_leak")
        moved = {name: getattr(self, name).put(move) for name in bases}
        return replace(self, **moved, **{name: move(getattr(self, name)) for name in arrays})


def build_matrices(measurements: Measurements, window: int, far: Size, dropped: Size) -> Matrices:
    """Build the paper's matrices.

    The patterns of the full near set are orthogonal over a window (equation 5), so the inverse
    is a scaled transpose, and what the dropped frequencies leave unseen is their own patterns.
    """
    far_basis = _centred(measurements, far_frequencies(far, measurements.projector), window)
    near_basis = _centred(measurements, near_frequencies(window, dropped), window)
    checkerboard = _centred(measurements, [CHECKERBOARD], window)
    lowest = real_basis(
        representatives(grid(dropped, Size(window, window))), measurements.projector
    )
    unseen = lowest.patterns_at(window_offsets(window)).T.astype(np.float64)
    energy = np.sum(near_basis.on_window.astype(np.float64) ** 2, axis=1)
    return Matrices(
        window,
        checkerboard,
        near_basis,
        far_basis,
        (near_basis.on_window / energy[:, None]).astype(np.float32),
        (unseen / np.linalg.norm(unseen, axis=0)).astype(np.float32),
        _leak(far_basis.basis, near_basis.basis),
        _leak(far_basis.basis, checkerboard.basis),
    )


def _leak(far: RealBasis, near: RealBasis) -> Floats:
    """Responses of each far coefficient to the patterns of another basis, (M, R), float32."""
    overlap = far.patterns.astype(np.float64) @ near.patterns.T.astype(np.float64)
    return np.asarray((far.weights[:, None] * overlap).astype(np.float32))
