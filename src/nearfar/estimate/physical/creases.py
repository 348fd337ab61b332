"""Places q that light of a crease has drawn towards the other side of it.

Next to a crease the other side lights a camera pixel from the projector pixel next to q, and an
estimate that has direct light between projector pixels may take that for direct light of a q that
is off by some tenths of a pixel. Where the places about it agree on another q, and the light so
taken falls off on that side as light of a crease does, it is inter-reflection.

Index convention: c runs over camera pixels.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers
from nearfar.estimate.physical.rows_about import REACH, rows_about_q
from nearfar.transport.direct import direct_weights
from nearfar.transport.model import Transport
from nearfar.transport.near import centre

# In projector pixels: how far a q is off, at least and at most.
OFF = (0.03, 0.3)
# Places about it differ among each other by less than this share of that.
AGREEMENT = 0.3
# Light beyond the one taken, over it: at least, or it does not fall off but stands alone, and at
# most, or it is direct light of another place.
LEAST_BEYOND = 0.03
MOST_BEYOND = 0.6
# Light on that side over light on the other.
ONE_SIDED = 2.0
# Wider footprints are of several projector pixels.
SINGLE_PIXEL = 1.2
# Camera pixels about one, in turn; each with those before and after it is a side.
RING = np.array([[-1, -1], [-1, 0], [-1, 1], [0, 1], [1, 1], [1, 0], [1, -1], [0, -1]])
SIDES = RING[(np.arange(8)[:, None] + np.arange(-1, 2)) % 8]


class Settled(NamedTuple):
    """Camera pixels whose direct light is that of another q.

    Attributes
    ----------
    pixels : ndarray of int, shape (n,)
    places : ndarray, shape (n, 2)
        q (y, x).
    kept : ndarray, shape (n,)
        Share of direct light that is left.
    """

    pixels: Integers
    places: Floats
    kept: Floats


def settled(transport: Transport, opaque: Booleans) -> Settled:
    """Find camera pixels at creases, and the q that the places about them tell.

    Parameters
    ----------
    transport : Transport
    opaque : ndarray of bool, shape (Cy, Cx)
        Camera pixels to look at, with direct light.

    Returns
    -------
    Settled
    """
    told, disagreement = _told_by_neighbours(transport)
    off = np.abs(transport.correspondence - told).max(axis=-1)
    # Comparisons with NaN are false: where no side tells anything.
    chosen = opaque & (off > OFF[0]) & (off < OFF[1]) & (disagreement < AGREEMENT * off)
    if transport.footprint is not None:
        chosen &= np.all(transport.footprint[..., :2] < SINGLE_PIXEL, axis=-1)
    pixels = np.flatnonzero(chosen)
    last = np.array(transport.projector) - 1
    places = np.clip(told.reshape(-1, 2)[pixels], 0, last)
    centres = np.rint(places).astype(np.int64)
    own = np.clip(transport.correspondence.reshape(-1, 2)[pixels], centres - 1, centres + 1)
    before, after = (np.asarray(direct_weights(q, centres)[:, 0]) for q in (own, places))
    kept = (before * after).sum(axis=1) / (after**2).sum(axis=1)
    moved = (1 - kept) * transport.direct.reshape(-1, transport.channels)[pixels].mean(axis=1)
    falls_off = _falls_off(transport, chosen, own - places, centres, moved)
    return Settled(pixels[falls_off], places[falls_off], kept[falls_off])


def _told_by_neighbours(transport: Transport) -> tuple[Floats, Floats]:
    """Return the q (Cy, Cx, 2) that camera pixels on one side tell, and how much they disagree.

    Two camera pixels on a line through a third tell its q by going on as far again. Of the eight
    sides it is the one from which q is drawn away, and where they agree the best. NaN where there
    is none.
    """
    height, width = transport.camera
    lit = transport.lit[..., None]
    q = np.where(lit, transport.correspondence, np.nan).astype(np.float64)
    padded = np.pad(q, ((2, 2), (2, 2), (0, 0)), constant_values=np.nan)

    def moved(step: Integers) -> Floats:
        y, x = 2 + step
        return np.asarray(padded[y : y + height, x : x + width])

    best, least = np.full(q.shape, np.nan), np.full(q.shape[:2], np.inf)
    for side in SIDES:
        next_ones = np.stack([moved(step) for step in side])
        told = 2 * next_ones - np.stack([moved(2 * step) for step in side])
        known = np.asarray(np.isfinite(told).all(axis=-1))
        several = known.sum(axis=0) > 1
        # Those that are not known take no part in the mean, nor disagree with it.
        told = np.where(known[..., None] & several[..., None], told, 0.0)
        count = np.where(several, known.sum(axis=0), np.nan)
        middle = told.sum(axis=0) / count[..., None]
        apart = np.abs(told - middle).max(axis=-1)
        disagreement = np.where(known, apart, 0.0).max(axis=0)
        inwards = np.where(known[..., None], next_ones, middle).mean(axis=0)
        away = ((q - middle) * (middle - inwards)).sum(axis=-1) > 0
        better = away & (disagreement < least)
        best[better], least[better] = middle[better], disagreement[better]
    return best, least


def _falls_off(
    transport: Transport, chosen: Booleans, drawn: Floats, centres: Integers, moved: Floats
) -> Booleans:
    """Return whether light about the one taken is that of a crease, shape (n,)."""
    axis = np.abs(drawn).argmax(axis=1)
    rows = np.arange(len(axis))
    side = np.zeros((len(axis), 2), dtype=np.int64)
    side[rows, axis] = np.sign(drawn[rows, axis]).astype(np.int64)
    along = np.zeros_like(side)
    along[rows, 1 - axis] = 1
    parts = [entries.mean(axis=1) for _, entries in rows_about_q(transport, chosen.ravel(), 1)]
    entries = np.concatenate([np.empty((0, (2 * REACH + 1) ** 2)), *parts])
    shift = centres - centre(transport.correspondence, transport.projector)[chosen.ravel()]

    def beyond(sign: int) -> Floats:
        steps = np.stack([2 * sign * side, sign * side + along, sign * side - along])
        y, x = np.moveaxis(REACH + shift + steps, -1, 0)
        return np.asarray(entries[rows, y * (2 * REACH + 1) + x])

    same, other = beyond(1), beyond(-1)
    mean = same.mean(axis=0)
    return np.asarray(
        (mean > LEAST_BEYOND * moved)
        & (same.max(axis=0) < MOST_BEYOND * moved)
        & (mean > ONE_SIDED * np.abs(other).mean(axis=0))
    )
