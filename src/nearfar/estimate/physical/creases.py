"""Places q that light of a crease has drawn towards the other side of it.

Next to a crease the other side lights a camera pixel from the projector pixel next to q, and an
estimate that has direct light between projector pixels may take that for direct light of a q that
is off by some hundredths or tenths of a pixel. Where the places on one side of it tell another q,
and the light so taken falls off as light of a crease does, it is inter-reflection.

Index convention: c runs over camera pixels.
"""

import numpy as np
from scipy import ndimage

from nearfar.arrays import Booleans, Floats, Integers
from nearfar.estimate.physical.elsewhere import Elsewhere, sees_single_pixels
from nearfar.estimate.physical.rows_about import REACH, of_rows_about_q
from nearfar.estimate.physical.told import told_by_others
from nearfar.transport.boxes import blurred_boxes, box_weights
from nearfar.transport.direct import direct_weights
from nearfar.transport.model import Transport
from nearfar.transport.near import centre
from nearfar.transport.seen import seen_of_projector

# In projector pixels: how far a q is off, at least and at most.
OFF = (0.02, 0.3)
# Camera pixels that make a line within the square that decides together, at least. Where there are
# fewer, a q that is off by more than this lies between two surfaces.
LINE, MOST_OFF_ALONE = 3, 0.2
# What others tell deviates by less than this share of that.
AGREEMENT = 0.2
# Light beyond the one taken, over it: at least, or it does not fall off but stands alone, and at
# most, or it is direct light of another place.
LEAST_BEYOND = 0.03
MOST_BEYOND = 0.6
# Light on that side over light on the other.
ONE_SIDED = 1.2
# What is next to a camera pixel.
NEXT_TO = np.ones((3, 3), dtype=bool)
# Side of the square of camera pixels that decide together whether light falls off.
TOGETHER = 7


def settled(transport: Transport, opaque: Booleans) -> Elsewhere:
    """Find camera pixels at creases, and the q that the places about them tell.

    Parameters
    ----------
    transport : Transport
    opaque : ndarray of bool, shape (Cy, Cx)
        Camera pixels to look at, with direct light.

    Returns
    -------
    Elsewhere
        All the direct light of these camera pixels.
    """
    single = opaque & sees_single_pixels(transport.footprint, transport.camera)
    # A crease is a line of camera pixels: those that may be drawn aside tell nothing of others.
    _, doubted = _drawn_aside(transport, single, transport.lit)
    others = transport.lit & ~ndimage.binary_dilation(doubted, NEXT_TO)
    told, chosen = _drawn_aside(transport, single, others)
    chosen &= _in_line(chosen) | (_off(transport, told) < MOST_OFF_ALONE)
    pixels = np.flatnonzero(chosen)
    last = np.array(transport.projector) - 1
    places = np.clip(told.reshape(-1, 2)[pixels], 0, last)
    centres = np.rint(places).astype(np.int64)
    own = np.clip(transport.correspondence.reshape(-1, 2)[pixels], centres - 1, centres + 1)
    if transport.footprint is None:
        before, after = (np.asarray(direct_weights(q, centres)[:, 0]) for q in (own, places))
    else:
        before = box_weights(own, centres, transport.boxes[pixels])
        after = box_weights(places, centres, _usual_footprints(transport)[pixels])
    kept = (before * after).sum(axis=1) / (after**2).sum(axis=1)
    direct = transport.direct.reshape(-1, transport.channels)[pixels]
    moved = (1 - kept) * direct.mean(axis=1)
    falls_off = _falls_off(transport, chosen, own - places, centres, moved)
    is_crease = _majority(pixels, falls_off, chosen) & (kept < 1)
    return Elsewhere(pixels, places, kept[:, None] * direct).of(is_crease)


def _usual_footprints(transport: Transport) -> Floats:
    """Return footprints that are blurred as most about each camera pixel are, (C, 4).

    Light of a crease may have given a camera pixel a footprint of its own.
    """
    seen = seen_of_projector(transport.correspondence)
    # Boxes that are blurred by a box of some width have the squares of both.
    blur = np.mean(transport.boxes[:, :2] ** 2 - seen[:, :2] ** 2, axis=1)
    blur = np.where(transport.lit, blur.reshape(transport.camera), 0.0)
    usual = ndimage.median_filter(blur, TOGETHER, mode="nearest")
    return blurred_boxes(seen, np.sqrt(np.maximum(usual, 0.0)).reshape(-1, 1))


def _drawn_aside(
    transport: Transport, single: Booleans, telling: Booleans
) -> tuple[Floats, Booleans]:
    """Return the q that others tell, (Cy, Cx, 2), and the camera pixels whose own q is another."""
    told, deviation = told_by_others(transport.correspondence, telling)
    off = _off(transport, told)
    # Comparisons with NaN are false: where no side tells anything.
    return told, single & (off > OFF[0]) & (off < OFF[1]) & (deviation < AGREEMENT * off)


def _off(transport: Transport, told: Floats) -> Floats:
    """Return by how much q is off from what others tell, (Cy, Cx), in projector pixels."""
    return np.asarray(np.abs(transport.correspondence - told).max(axis=-1))


def _in_line(chosen: Booleans) -> Booleans:
    """Return which camera pixels have enough chosen ones about them to be a line, (Cy, Cx)."""
    share = ndimage.uniform_filter(chosen.astype(np.float64), TOGETHER, mode="constant")
    return np.asarray(share * TOGETHER**2 > LINE - 0.5)


def _majority(pixels: Integers, votes: Booleans, chosen: Booleans) -> Booleans:
    """Return, for each chosen camera pixel, the majority vote of those about it, (n,).

    Parameters
    ----------
    pixels : ndarray of int, shape (n,)
        The chosen camera pixels.
    votes : ndarray of bool, shape (n,)
        The vote of each. A tie counts as true.
    chosen : ndarray of bool, shape (Cy, Cx)
    """
    signs = np.zeros(chosen.shape)
    signs.ravel()[pixels] = np.where(votes, 1.0, -1.0)
    balance = ndimage.uniform_filter(signs, TOGETHER, mode="constant").ravel()[pixels]
    # Sums of whole numbers, but for rounding.
    return np.asarray(balance > -0.5 / TOGETHER**2)


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
    entries = of_rows_about_q(
        transport, chosen.ravel(), 1, lambda _pixels, each: np.asarray(each.mean(axis=1))
    )
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
