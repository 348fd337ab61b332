"""Direct light's footprint on a fine projector: how large it is, and what it answers to patterns.

A camera pixel sees a part of a projector pixel or several of them: as many as q moves from one
camera pixel to the next, and more through the blur of the projector. The first follows from q. The
second is the blur under which direct light's responses to the highest frequencies, where near- and
far-range light have faded, are most like the measured ones. Neighbours vote for it together.

Index convention: arrays are (n, channels, ...); r runs over real responses, s over blurs.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from nearfar.arrays import Booleans, Floats, Size, blocks
from nearfar.illumination.centred_basis import CentredBasis, centred_basis
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import real_basis
from nearfar.parallel import side_by_side
from nearfar.photometry.measurements import Measurements
from nearfar.transport import near
from nearfar.transport.boxes import box_overlaps
from nearfar.transport.direct import direct_weights

# Least frequency, in cycles per cell of the coarsest pitch: near-range light has faded there.
LEAST_CYCLES = 0.45
# Widths of boxes, in projector pixels, that stand for the projector's blur.
BLURS = np.array([0.0, 0.5, 0.75, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0])
# Side of the square of camera pixels that vote.
VOTERS = 7
# q moves from one camera pixel to the next by the median over a square of this side.
MEDIAN_SIDE = 3
# Rows of the camera on either side of a camera pixel that its footprint depends on.
VOTING_ROWS = VOTERS // 2 + MEDIAN_SIDE // 2 + 1
# Step of the differences by which direct light's derivatives are taken, in projector pixels.
STEP = 0.05
# A farther move, in projector pixels, leads to another surface.
LARGEST_MOVE = 24.0
# Moves to both sides stay on one surface if the larger is at most as many times the smaller, plus
# as many projector pixels.
LARGEST_RATIO, LARGEST_DIFFERENCE = 1.5, 0.5
# Steps by which the middles of boxes are found from their centroids.
CENTRE_STEPS = 12
BATCH_PIXELS = 4096


def footprint_weights(
    correspondence: Floats, centres: NDArray[np.int64], boxes: Floats, centred: CentredBasis
) -> Floats:
    """Return unit direct light and its derivatives by q, as weights of ``centred.on_footprint``.

    Parameters
    ----------
    correspondence : ndarray, shape (n, 2)
    centres : ndarray of int, shape (n, 2)
        q rounded.
    boxes : ndarray, shape (n, 2)
        Heights and widths of footprints; not used where the footprint is bilinear.
    centred : CentredBasis

    Returns
    -------
    ndarray, shape (n, 3, 9) or (n, 3, R), float32
        0 without direct light.
    """
    if centred.near_basis.pitch == 1:
        return direct_weights(correspondence, centres)
    lit: Booleans = np.asarray(np.isfinite(correspondence).all(axis=1))
    offsets = np.where(lit[:, None], correspondence - centres, 0.0).astype(np.float32)
    reach = _reach(boxes)
    overlaps, slopes = [], []
    for axis in (0, 1):
        at, before, after = (
            box_overlaps(offsets[:, axis] + np.float32(step), boxes[:, axis], reach)
            for step in (0.0, -STEP, STEP)
        )
        overlaps.append(at)
        slopes.append((after - before) / (2 * STEP))
    waves, steep = (
        [_waves(values, axis, centred) for axis, values in enumerate(of_axes)]
        for of_axes in (overlaps, slopes)
    )
    found = np.empty((len(offsets), 3, centred.basis.count), dtype=np.float32)
    parts = ((waves[0], waves[1]), (steep[0], waves[1]), (waves[0], steep[1]))
    for place, (down, across) in enumerate(parts):
        found[:, place] = _real(down * across, centred)
    found[~lit] = 0.0
    return found


def _reach(boxes: Floats) -> int:
    """Return the projector pixels from the rounded q that boxes may touch."""
    return int(np.ceil(0.5 * boxes.max(initial=0.0) + 0.5 + STEP)) + 1


def _waves(overlaps: Floats, axis: int, centred: CentredBasis) -> NDArray[np.complex64]:
    """Return conjugate responses of shares of pixels (n, 2 reach + 1) along one axis, (n, K)."""
    pixels = np.arange(overlaps.shape[1]) - overlaps.shape[1] // 2
    cycles, which = np.unique(centred.basis.cycles[:, axis], return_inverse=True)
    waves = np.exp(2j * np.pi * np.outer(pixels, cycles)).astype(np.complex64)
    return np.take(overlaps.astype(np.float32) @ waves, which.ravel(), axis=1)


def _real(waves: NDArray[np.complex64], centred: CentredBasis) -> Floats:
    """Return the responses to cosines and sines, (n, R), of conjugate responses (n, K)."""
    basis = centred.basis
    # The parts of a complex number are its cosine and its sine, where a frequency has both.
    return np.asarray(waves.view(np.float32)[:, 2 * basis.index + basis.is_sine])


def footprint_boxes(
    measurements: Measurements, correspondence: Floats, near_basis: NearBasis
) -> Floats | None:
    """Return height and width of each camera pixel's footprint.

    Parameters
    ----------
    measurements : Measurements
    correspondence : ndarray, shape (Cy, Cx, 2)
    near_basis : NearBasis

    Returns
    -------
    ndarray, shape (C, 2), float32
        Projector pixels; 0 without direct light. None where functions are of single pixels, and
        the footprint is bilinear.
    """
    if near_basis.pitch == 1:
        return None
    basis, camera = measurements.basis, measurements.camera
    spread = seen_of_projector(correspondence)
    high = [
        k
        for k, cycles in zip(basis.frequencies, basis.cycles, strict=True)
        if np.hypot(*cycles) * near_basis.pitch >= LEAST_CYCLES
    ]
    if not high:
        return spread
    indices = measurements.response_indices(high)
    centred = centred_basis(real_basis(high, measurements.projector), near_basis)
    number, blurs = camera.pixels, BLURS[near_basis.pitch >= BLURS]
    q = correspondence.reshape(-1, 2).astype(np.float64)
    lit: Booleans = np.asarray(np.isfinite(q).all(axis=1))
    centres = near.centre(correspondence, measurements.projector)
    weight = measurements.multiplicity[indices]
    explained = np.zeros((number, len(blurs)), dtype=np.float32)

    def work(batch: slice) -> None:
        responses = centred.recentre(measurements.responses[batch][..., indices], centres[batch])
        noise = np.maximum(measurements.noise[batch] ** 2, 1e-12)
        offsets = np.where(lit[batch, None], q[batch] - centres[batch], 0.0).astype(np.float32)
        for place, blur in enumerate(blurs):
            boxes = np.hypot(spread[batch], blur)
            reach = _reach(boxes)
            down, across = (
                _waves(box_overlaps(offsets[:, axis], boxes[:, axis], reach), axis, centred)
                for axis in (0, 1)
            )
            direct = _real(down * across, centred)
            along = np.maximum(np.einsum("nir,nr->ni", responses * weight, direct), 0.0)
            squared = np.maximum(np.einsum("nr,nr->n", direct * weight, direct), 1e-12)
            explained[batch, place] = np.sum(along**2 / noise, axis=1) / squared

    side_by_side(work, blocks(number, BATCH_PIXELS))
    explained *= lit[:, None]
    voted = ndimage.uniform_filter(
        explained.reshape(*camera, -1), (VOTERS, VOTERS, 0), mode="nearest"
    ).reshape(number, -1)
    blur = blurs[np.argmax(voted, axis=1)]
    return np.asarray(np.hypot(spread, blur[:, None]) * lit[:, None], dtype=np.float32)


def box_centres(correspondence: Floats) -> Floats:
    """Return the middles of the boxes whose centroids on the pixels are q, (Cy, Cx, 2).

    The centroid of the shares of a box in whole pixels is not its middle: that of a box within one
    pixel is the pixel's.

    Parameters
    ----------
    correspondence : ndarray, shape (Cy, Cx, 2)
        q as correspondence finds it, a centroid.
    """
    q = correspondence.reshape(-1, 2).astype(np.float64)
    boxes = seen_of_projector(correspondence)
    found = np.nan_to_num(q, nan=0.0)
    for batch in blocks(len(q), BATCH_PIXELS):
        rounded = np.rint(found[batch])
        wanted, widths = found[batch] - rounded, boxes[batch]
        reach = _reach(widths)
        pixels = np.arange(-reach, reach + 1)
        middles = wanted.copy()
        for _ in range(CENTRE_STEPS):
            for axis in (0, 1):
                overlaps = box_overlaps(middles[:, axis], widths[:, axis], reach)
                # A centroid moves by at most 1 / width times as much as the middle.
                off = wanted[:, axis] - overlaps @ pixels
                middles[:, axis] += off * np.clip(widths[:, axis], 0.0, 1.0)
        found[batch] = rounded + middles
    return np.where(np.isnan(q), np.nan, found).reshape(correspondence.shape)


def seen_of_projector(correspondence: Floats) -> Floats:
    """Return the height and width of what each camera pixel sees of the projector, (C, 2), float32.

    A parallelogram whose sides are how far q moves from one camera pixel to the next has the same
    spread along each axis as a box of the root of the sum of their squares.

    Parameters
    ----------
    correspondence : ndarray, shape (Cy, Cx, 2)
        q.
    """
    camera = Size(*correspondence.shape[:2])
    squared = np.zeros((*camera, 2))
    for axis in (0, 1):
        move = np.abs(np.diff(correspondence, axis=axis))
        move[~(move.max(axis=-1) <= LARGEST_MOVE)] = np.nan
        padding = [(0, 0)] * 3
        padding[axis] = (1, 1)
        padded = np.pad(move, padding, constant_values=np.nan)
        both = (np.delete(padded, 0, axis=axis), np.delete(padded, -1, axis=axis))
        # The mean of the moves to both sides, or the smaller if one leads to another surface.
        least, most = np.fmin(*both), np.fmax(*both)
        alike = most.max(axis=-1) <= LARGEST_RATIO * least.max(axis=-1) + LARGEST_DIFFERENCE
        known = np.nan_to_num(np.where(alike[..., None], (least + most) / 2, least), nan=0.0)
        squared += (
            np.stack(
                [
                    ndimage.median_filter(known[..., part], MEDIAN_SIDE, mode="nearest")
                    for part in (0, 1)
                ],
                axis=-1,
            )
            ** 2
        )
    return np.sqrt(squared).reshape(-1, 2).astype(np.float32)
