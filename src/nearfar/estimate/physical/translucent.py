"""Which camera pixels see a translucent surface.

Light under a surface comes to q from all sides and fades within some projector pixels. Light from a
crease or a contact comes from one side, or from two, and far-range light does not fade. Offsets
about q are divided into four quadrants, up, down, left and right of q. Camera pixels where light
next to q stands out in all four are translucent, and so are those about them where it stands out in
three: at the outline of a translucent body one side is dark.
"""

from typing import NamedTuple

import numpy as np
from scipy import ndimage

from nearfar.arrays import Booleans, Floats, Integers
from nearfar.estimate.physical.rows_about import of_rows_about_q, offsets
from nearfar.transport.model import Transport

# Distances from q in steps: where light under a surface is seen beside direct light,
# and where it has faded.
NEXT_TO_Q = (1.4, 3.2)
FADED = (4.5, 6.1)
# Light of the mean entry next to q over 25 entries, as a share of all light under white.
LEAST_SHARE_ON_ALL_SIDES = 0.06
LEAST_SHARE_ON_THREE_SIDES = 0.05
# Of the light under white, in photo units: what is darker than this tells nothing.
DARK = 0.02
ENTRIES = 25
# Fewer camera pixels are no surface.
LEAST_PIXELS = 12
SQUARE = np.ones((3, 3), dtype=bool)


class Sides(NamedTuple):
    """Light next to q as a share of all light, by quadrants, shape (C,) each.

    Attributes
    ----------
    all_four : ndarray
        In the darkest quadrant.
    three : ndarray
        In the second darkest.
    """

    all_four: Floats
    three: Floats


def translucent(transport: Transport) -> Booleans:
    """Return which camera pixels see a translucent surface, shape (Cy, Cx).

    Parameters
    ----------
    transport : Transport

    Returns
    -------
    ndarray of bool, shape (Cy, Cx)
    """
    sides = _sides(transport)
    camera = transport.camera
    lit = transport.lit
    all_four, three = (
        ndimage.median_filter(share.reshape(camera), 3, mode="nearest") for share in sides
    )
    seeds = (all_four > LEAST_SHARE_ON_ALL_SIDES) & lit
    grown = (three > LEAST_SHARE_ON_THREE_SIDES) & lit
    found = ndimage.binary_propagation(seeds, mask=seeds | grown)
    closed = ndimage.binary_closing(found, SQUARE) & lit
    bodies, count = ndimage.label(found | closed, SQUARE)
    sizes = np.bincount(bodies.ravel(), minlength=count + 1)
    large = sizes >= LEAST_PIXELS
    large[0] = False
    kept: Booleans = large[bodies]
    return kept


def _sides(transport: Transport) -> Sides:
    """Return light next to q on the darkest sides."""
    # Half the distance of the coarsest functions of near-range light.
    step = max(1, transport.pitch // 2)
    down, across = offsets().T
    distance = np.hypot(down, across)
    near = (distance >= NEXT_TO_Q[0]) & (distance <= NEXT_TO_Q[1])
    faded = (distance >= FADED[0]) & (distance <= FADED[1])
    quadrants = np.stack(
        [
            down >= np.abs(across),
            -down >= np.abs(across),
            across >= np.abs(down),
            -across >= np.abs(down),
        ]
    )
    means = [quadrants & ring for ring in (near, faded)]
    next_to_q, background = (ring / ring.sum(axis=1, keepdims=True) for ring in means)
    white = np.asarray(transport @ np.ones(transport.projector, dtype=np.float32))
    white = white.reshape(-1, transport.channels).mean(axis=1)
    found = np.zeros((transport.camera.pixels, 2))

    def darkest(pixels: Integers, entries: Floats) -> Floats:
        mean = entries.mean(axis=1)
        light = mean @ next_to_q.T - np.maximum(mean @ background.T, 0.0)
        light *= ENTRIES / (white[pixels, None] + DARK)
        return np.asarray(np.sort(light, axis=1)[:, :2])

    lit = transport.lit.ravel()
    found[lit] = of_rows_about_q(transport, lit, step, darkest)
    return Sides(found[:, 0], found[:, 1])
