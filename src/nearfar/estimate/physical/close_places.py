"""Second places close to q, whose direct light an estimate takes for near-range light.

Beyond the window of near-range light an estimate looks for a second place itself. Within it, direct
light of a second surface is a peak that stands alone, a few projector pixels from q. At a crease,
light of the other surface may make a peak, too, but there q goes on from one surface to the other.

Index convention: n runs over camera pixels that may have a peak, o over `rows_about.offsets`.
"""

from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from nearfar.arrays import Booleans, Floats, Integers
from nearfar.estimate.physical.around import DIRECTIONS, longest_step_of_q, moved, steps
from nearfar.estimate.physical.cells import cell_side
from nearfar.estimate.physical.elsewhere import Elsewhere, sees_single_pixels
from nearfar.estimate.physical.rows_about import REACH, of_rows_about_q, offsets
from nearfar.estimate.physical.split import DARK, PhysicalSplit, opaque
from nearfar.transport.model import Transport

# Cells from q to a peak of 3x3, at least; those around it, of 5x5 cells, are known.
LEAST_DISTANCE, FROM_THE_END = 2.0, 2
# Light of a peak as a share of all light, at least, and what else the cells around it hold, as a
# share of the peak, at most.
LEAST_SHARE, LARGEST_AROUND = 0.1, 0.3
# The next camera pixel sees a place that is nearer to the peak than q by so many steps of q; and
# inter-reflection's share of light is so many times that of the camera pixels up to some steps away
# on both sides, in one direction.
LEAST_GAP, LEAST_RATIO, SIDES = 1.5, 1.5, 2


class _Peaks(NamedTuple):
    """The largest peak of each camera pixel's near- and far-range light.

    Attributes
    ----------
    light : ndarray, shape (n, channels)
        Beyond that of the cells around it.
    around : ndarray, shape (n,)
        Of all channels, as much as the cells around it have.
    places : ndarray, shape (n, 2)
        (y, x) on the projector.
    """

    light: Floats
    around: Floats
    places: Floats


def with_close_places(split: PhysicalSplit) -> PhysicalSplit:
    """Return a split with direct light from second places close to q, where opaque surfaces end.

    Parameters
    ----------
    split : PhysicalSplit

    Returns
    -------
    PhysicalSplit
    """
    transport = split.transport
    channels = transport.channels
    chosen = opaque(split) & sees_single_pixels(split.footprint, transport.camera)
    chosen.ravel()[split.elsewhere.pixels] = False
    pixels = np.flatnonzero(chosen)
    peaks = _largest_peaks(transport, chosen.ravel())
    white = np.ones(transport.projector, dtype=np.float32)
    parts = [np.reshape(part, (-1, channels)) for part in split.components(white)]
    light = peaks.light.sum(axis=1)
    total = np.maximum(np.asarray(sum(parts)).sum(axis=1), DARK)
    share = light / total[pixels]
    found = (share > LEAST_SHARE) & (peaks.around < LARGEST_AROUND * light)
    rest = (parts[2].sum(axis=1) / total).reshape(transport.camera)
    pixels, places = pixels[found], peaks.places[found]
    second = _over_both_sides(rest).ravel()[pixels] > LEAST_RATIO
    second &= _are_seen_beside(transport, pixels, places)
    direct = np.clip(peaks.light[found], 0.0, np.maximum(parts[2][pixels], 0.0))
    others = Elsewhere(pixels[second], places[second], direct[second])
    return replace(split, elsewhere=split.elsewhere.and_also(others))


def _largest_peaks(transport: Transport, chosen: Booleans) -> _Peaks:
    """Return the largest peak that is not next to q of each chosen camera pixel."""
    step, channels, side = cell_side(transport), transport.channels, 2 * REACH + 1
    from_q = offsets()
    inside = np.hypot(*from_q.T) >= LEAST_DISTANCE
    inside &= np.abs(from_q).max(axis=1) <= REACH - FROM_THE_END

    def largest(_pixels: Integers, entries: Floats) -> Floats:
        squares = entries.astype(np.float64).reshape(-1, channels, side, side)
        of_9, of_25 = (
            length**2 * ndimage.uniform_filter(squares, (1, 1, length, length), mode="constant")
            for length in (3, 5)
        )
        around = np.maximum(of_25 - of_9, 0.0) * (9 / 16)
        beyond, around = (part.reshape(entries.shape) for part in (of_9 - around, around))
        peak = np.where(inside, beyond.sum(axis=1), -np.inf).argmax(axis=1)
        numbers = np.arange(len(entries))
        # The place is the mean of the peak's cells.
        cells = peak[:, None] + (side * steps(1) @ [1, 0] + steps(1) @ [0, 1])
        cells = np.concatenate([cells, peak[:, None]], axis=1)
        weights = np.maximum(entries.sum(axis=1)[numbers[:, None], cells], 0.0)
        weights /= np.maximum(weights.sum(axis=1, keepdims=True), DARK)
        place = (weights[..., None] * from_q[cells]).sum(axis=1)
        found = beyond[numbers, :, peak], around[numbers, :, peak].sum(axis=1, keepdims=True)
        return np.concatenate([*found, place], axis=1)

    found = of_rows_about_q(transport, chosen, step, largest)
    light, around, place = np.split(found, [channels, channels + 1], axis=1)
    q = np.rint(transport.correspondence.reshape(-1, 2)[chosen])
    last = np.array(transport.projector) - 1.0
    return _Peaks(light, around[:, 0], np.clip(q + step * place, 0.0, last))


def _are_seen_beside(transport: Transport, pixels: Integers, places: Floats) -> Booleans:
    """Return whether the next camera pixels see places, beyond where q goes on to.

    Parameters
    ----------
    transport : Transport
    pixels : ndarray of int, shape (n,)
    places : ndarray, shape (n, 2)
    """
    q = np.where(transport.lit[..., None], transport.correspondence, np.nan)
    nearest = np.full(len(pixels), np.inf)
    for each in steps(1):
        theirs = moved(q, each, np.nan).reshape(-1, 2)[pixels]
        nearest = np.fmin(nearest, np.hypot(*(theirs - places).T))
    gap = np.hypot(*(q.reshape(-1, 2)[pixels] - places).T)
    return np.asarray(nearest < gap - LEAST_GAP * longest_step_of_q(transport))


def _over_both_sides(share: Floats) -> Floats:
    """Return a share over the larger one of both sides, in the direction where that is the most."""
    found = np.zeros(share.shape)
    for direction, count in product(DIRECTIONS, range(1, SIDES + 1)):
        sides = (moved(share, sign * count * direction, np.inf) for sign in (1, -1))
        found = np.maximum(found, share / np.maximum(np.maximum(*sides), DARK))
    return found
