"""Direct light's footprint on a fine projector: how large it is, and what it answers to patterns.

A camera pixel sees a part of a projector pixel or several of them: as many as q moves from one
camera pixel to the next, and more through the blur of the projector. The first follows from q. The
second is the blur under which direct light's responses to the highest frequencies, where near- and
far-range light have faded, are most like the measured ones. Neighbours vote for it together.

Index convention: arrays are (n, channels, ...); r runs over real responses, s over blurs.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from nearfar.arrays import Booleans, Floats, Integers, blocks
from nearfar.estimate.joint.box_waves import (
    explained_by_boxes,
    of_boxes,
    put_with_derivatives,
    wave_table,
)
from nearfar.illumination.centred_basis import CentredBasis, centred_basis
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import real_basis
from nearfar.parallel import side_by_side
from nearfar.photometry.measurements import Measurements
from nearfar.transport import near
from nearfar.transport.boxes import blurred_boxes
from nearfar.transport.direct import direct_weights
from nearfar.transport.seen import SEEN_ROWS, reach_of

# Least frequency, in cycles per cell of the coarsest pitch: near-range light has faded there. With
# 0.45, footprints at 512x512 come out too wide, and a random light loses 5.7 dB.
LEAST_CYCLES = 1.8
# The same in cycles per projector pixel, where that is less: plans reach 0.4.
LEAST_CYCLES_PER_PIXEL = 0.2
# Widths of boxes, in projector pixels, that stand for the projector's blur.
BLURS = np.array([0.0, 0.5, 0.75, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0])
# Side of the square of camera pixels that vote.
VOTERS = 7
# Rows of the camera on either side of a camera pixel that its footprint depends on.
VOTING_ROWS = VOTERS // 2 + SEEN_ROWS
# Step of the differences by which direct light's derivatives are taken, in projector pixels. Boxes
# that lie within one pixel do not change with q: with 0.05, derivatives next to such places say too
# little, and q moves too far.
STEP = 0.1
BATCH_PIXELS = 4096


def footprint_weights(
    correspondence: Floats, centres: NDArray[np.int64], footprints: Floats, centred: CentredBasis
) -> Floats:
    """Return unit direct light and its derivatives by q, as weights of ``centred.on_footprint``.

    Parameters
    ----------
    correspondence : ndarray, shape (n, 2)
    centres : ndarray of int, shape (n, 2)
        q rounded.
    footprints : ndarray, shape (n, 4)
        As `nearfar.transport.boxes` describes them; not used where the footprint is bilinear.
    centred : CentredBasis

    Returns
    -------
    ndarray, shape (n, 3, 9) or (n, 3, R), float32
        0 without direct light.
    """
    if centred.near_basis.pitch == 1:
        return direct_weights(correspondence, centres)
    found = np.empty((len(centres), 3, centred.basis.count), dtype=np.float32)
    put_footprint_weights(correspondence, centres, footprints, centred, 0, found)
    return found


def put_footprint_weights(
    correspondence: Floats,
    centres: NDArray[np.int64],
    footprints: Floats,
    centred: CentredBasis,
    first: int,
    found: Floats,
) -> None:
    """Write `footprint_weights` of hats into (n, G, R), from `first` of its second axis on."""
    lit: Booleans = np.asarray(np.isfinite(correspondence).all(axis=1))
    middles = np.where(lit[:, None], correspondence - centres, 0.0)
    table = wave_table(centred, reach_of(footprints, STEP))
    put_with_derivatives(middles, footprints, STEP, table, first, found)
    found[~lit, first:] = 0.0


def unit_responses(middles: Floats, footprints: Floats, centred: CentredBasis) -> Floats:
    """Return responses of unit direct light, (n, R), at middles (n, 2) from rounded q."""
    return of_boxes(middles, footprints, wave_table(centred, reach_of(footprints)))


def footprint_boxes(
    measurements: Measurements, correspondence: Floats, seen: Floats, near_basis: NearBasis
) -> Floats:
    """Return each camera pixel's footprint, blurred as neighbours vote.

    Parameters
    ----------
    measurements : Measurements
    correspondence : ndarray, shape (Cy, Cx, 2)
        Middles of the footprints.
    seen : ndarray, shape (C, 4)
        What each camera pixel sees without blur, as `seen_of_projector` tells it.
    near_basis : NearBasis
        At a pitch over 1.

    Returns
    -------
    ndarray, shape (C, 4), float32
        As `nearfar.transport.boxes` describes them; 0 without direct light.
    """
    camera = measurements.camera
    q = correspondence.reshape(-1, 2).astype(np.float64)
    lit: Booleans = np.asarray(np.isfinite(q).all(axis=1))
    high = high_responses(measurements, near_basis)
    if high is None:
        return seen * lit[:, None]
    number, blurs = camera.pixels, BLURS[near_basis.pitch >= BLURS]
    centres = near.centre(correspondence, measurements.projector)
    explained = np.zeros((number, len(blurs)), dtype=np.float32)

    # Every other camera pixel votes, as on a chessboard: tiles begin at even rows.
    is_even = np.indices(camera).sum(axis=0).ravel() % 2 == 0
    voters = np.flatnonzero(lit & is_even)

    def work(batch: slice) -> None:
        some = voters[batch]
        responses = high.at(some, centres[some])
        explained[some] = high.explained(responses, q[some] - centres[some], seen[some], blurs)

    side_by_side(work, blocks(len(voters), BATCH_PIXELS))
    voted = ndimage.uniform_filter(
        explained.reshape(*camera, -1), (VOTERS, VOTERS, 0), mode="nearest"
    ).reshape(number, -1)
    blur = blurs[np.argmax(voted, axis=1)]
    return blurred_boxes(seen, blur[:, None]) * lit[:, None]


@dataclass(frozen=True, eq=False)
class HighResponses:
    """Responses to frequencies at which near- and far-range light have faded.

    Attributes
    ----------
    measurements : Measurements
    indices : ndarray of int, shape (R,)
        Of these responses among the measured ones.
    centred : CentredBasis
        Their frequencies.
    """

    measurements: Measurements
    indices: NDArray[np.int64]
    centred: CentredBasis

    @property
    def roots(self) -> Floats:
        """One measurement's noise in units of each response's, (R,), float32."""
        roots = np.sqrt(self.measurements.multiplicity[self.indices])
        return np.asarray(roots.astype(np.float32))

    def at(self, selected: slice | Integers, centres: NDArray[np.int64]) -> Floats:
        """Return re-centred responses over the noise, (n, channels, R), of some camera pixels."""
        noise = np.maximum(self.measurements.noise[selected], 1e-6)[..., None]
        responses = np.take(self.measurements.responses[selected], self.indices, axis=-1)
        recentred = self.centred.recentre(responses, centres)
        return recentred * (self.roots / noise).astype(np.float32)

    def explained(
        self, responses: Floats, middles: Floats, footprints: Floats, blurs: Floats
    ) -> Floats:
        """Return how much of the power of responses direct light of footprints explains, (n, S).

        Parameters
        ----------
        responses : ndarray, shape (n, channels, R)
            As `at` gives them.
        middles : ndarray, shape (n, 2)
            Middles of the footprints, from the rounded q.
        footprints : ndarray, shape (n, 4)
        blurs : ndarray, shape (S,)
            Widths of boxes that they are blurred by.
        """
        # A blurred box is no wider than the box and the blur.
        table = wave_table(self.centred, reach_of(footprints, 0.5 * float(blurs.max())))
        return explained_by_boxes(responses, self.roots, middles, footprints, blurs, table)


def high_responses(measurements: Measurements, near_basis: NearBasis) -> HighResponses | None:
    """Return the responses to the highest frequencies, or None if none was measured."""
    basis = measurements.basis
    least = min(LEAST_CYCLES / near_basis.pitch, LEAST_CYCLES_PER_PIXEL)
    high = [
        k
        for k, cycles in zip(basis.frequencies, basis.cycles, strict=True)
        if np.hypot(*cycles) >= least
    ]
    if not high:
        return None
    centred = centred_basis(real_basis(high, measurements.projector), near_basis)
    return HighResponses(measurements, measurements.response_indices(high), centred)
