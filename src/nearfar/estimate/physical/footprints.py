"""Footprints of direct light at translucent surfaces, without the blur of light under them.

Where functions of near-range light are of several projector pixels, an estimate finds how much the
projector blurs from how direct light's responses fade towards high frequencies. Light under a
surface fades there as well, and is taken for blur. Direct light then comes out too bright: by half
on a candle whose light comes from 1.3 projector pixels deep. A projector blurs what stands next to
a body as it blurs the body.
"""

import numpy as np
from scipy import ndimage

from nearfar.arrays import Booleans, Floats
from nearfar.estimate.physical.cells import camera_pixels_to_a_cell
from nearfar.transport.model import Transport
from nearfar.transport.seen import seen_of_projector

# Camera pixels closer to a body than so many cells may see a part of it; those farther away than so
# many tell nothing of it.
OUTLINE_REACH, BESIDE_REACH = 3, 13
# Fewer camera pixels do not tell the blur.
LEAST_BESIDE = 12


def footprints(transport: Transport, seen: Booleans) -> Floats:
    """Return direct light's footprints, those at translucent surfaces as opaque ones have them.

    Parameters
    ----------
    transport : Transport
    seen : ndarray of bool, shape (Cy, Cx)
        Camera pixels that see a translucent surface.

    Returns
    -------
    ndarray, shape (C, 4)
        As `Transport.boxes`.
    """
    boxes = transport.boxes
    if transport.footprint is None or not seen.any():
        return boxes
    finer = camera_pixels_to_a_cell(transport)
    unblurred = seen_of_projector(transport.correspondence)
    # Boxes that are blurred by a box of some width have the squares of both.
    blur = np.mean(boxes[:, :2] ** 2 - unblurred[:, :2] ** 2, axis=1).reshape(transport.camera)
    distance, nearest = ndimage.distance_transform_edt(~seen, return_indices=True)
    close = distance <= OUTLINE_REACH * finer
    beside = transport.lit & ~close & (distance <= BESIDE_REACH * finer)
    bodies, count = ndimage.label(close)
    bodies_nearby = bodies[tuple(nearest)]
    found = boxes.copy()
    for number in range(1, count + 1):
        told = blur[beside & (bodies_nearby == number)]
        if len(told) < LEAST_BESIDE:
            continue
        least = max(0.0, float(np.median(told)))
        here = ((bodies == number) & transport.lit).ravel()
        squares = unblurred[here, :2] ** 2 + np.clip(blur.ravel()[here], 0.0, least)[:, None]
        found[here] = np.concatenate([np.sqrt(squares), unblurred[here, 2:]], axis=1)
    return found
