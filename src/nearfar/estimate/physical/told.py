"""What the q of camera pixels on one side tell of the q of a camera pixel.

Near edges and creases q changes its course, so that only one side may go on to a camera pixel.
"""

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.estimate.physical.around import moved, steps
from nearfar.transport.model import Transport

# Camera pixels about one, in turn; each with those before and after it is a side.
RING = np.array([[-1, -1], [-1, 0], [-1, 1], [0, 1], [1, 1], [1, 0], [1, -1], [0, -1]])
SIDES = RING[(np.arange(8)[:, None] + np.arange(-1, 2)) % 8]
# Camera pixels on each side through whose q a plane is laid, and half of the angle they lie in.
PLANE_REACH = 3
HALF_ANGLE = np.pi / 4 + 0.01


def _known(transport: Transport) -> Floats:
    """Return q, NaN at camera pixels without direct light, float64."""
    lit = transport.lit[..., None]
    return np.where(lit, transport.correspondence, np.nan).astype(np.float64)


def told_by_lines(transport: Transport) -> tuple[Floats, Floats]:
    """Return the q (Cy, Cx, 2) that camera pixels on one side tell, and how much they disagree.

    Two camera pixels on a line through a third tell its q by going on as far again. Of the eight
    sides it is the one from which q is drawn away, and where they agree the best. NaN where there
    is none.
    """
    q = _known(transport)
    best, least = np.full(q.shape, np.nan), np.full(q.shape[:2], np.inf)
    for side in SIDES:
        next_ones = np.stack([moved(q, step, np.nan) for step in side])
        told = 2 * next_ones - np.stack([moved(q, 2 * step, np.nan) for step in side])
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


def told_by_planes(transport: Transport) -> tuple[Floats, Floats]:
    """Return the same, told by planes through more camera pixels, where all of a side are known.

    How much they disagree is the root mean square of what their q deviate from the plane.
    """
    q = _known(transport)
    best, least = np.full(q.shape, np.nan), np.full(q.shape[:2], np.inf)
    for side in _wedges():
        design = np.column_stack([np.ones(len(side)), side])
        inverse = np.linalg.pinv(design)
        places = np.stack([moved(q, step, np.nan) for step in side])
        plane = np.einsum("in,nyxa->iyxa", inverse, places)
        places -= np.einsum("ni,iyxa->nyxa", design, plane)
        freedom = len(side) - design.shape[1]
        apart = np.sqrt(np.einsum("nyxa,nyxa->yxa", places, places) / freedom).max(axis=-1)
        middle = plane[0]
        inwards = np.einsum("i,iyxa->yxa", side.mean(axis=0), plane[1:])
        away = ((middle - q) * inwards).sum(axis=-1) > 0
        better = away & (apart < least)
        best[better], least[better] = middle[better], apart[better]
    return best, least


def _wedges() -> list[Integers]:
    """Return the steps to the camera pixels on each of eight sides, (n, 2) each."""
    every = steps(PLANE_REACH)
    every = every[np.hypot(*every.T) <= PLANE_REACH]
    angle = np.arctan2(*every.T)
    turns = np.pi / 4 * np.arange(8)
    off = np.abs((angle - turns[:, None] + np.pi) % (2 * np.pi) - np.pi)
    return [every[one] for one in off <= HALF_ANGLE]
