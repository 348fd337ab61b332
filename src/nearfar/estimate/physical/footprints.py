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
from nearfar.transport.boxes import blurred_boxes
from nearfar.transport.model import Transport
from nearfar.transport.seen import seen_of_projector

# Camera pixels closer to a body may see a part of it; those farther away tell nothing of it. In
# cells, or in camera pixels where these are larger.
OUTLINE_REACH, BESIDE_REACH = 3, 13
# Fewer camera pixels do not tell the blur.
LEAST_BESIDE = 12


def footprints(transport: Transport, seen: Booleans) -> Floats:
    """Return direct light's footprints, at translucent surfaces without light under them.

    At a body and next to it, a footprint is at most what q says that the camera pixel sees, blurred
    as the opaque camera pixels beside the body are.

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
        widest = blurred_boxes(unblurred, float(np.sqrt(max(0.0, np.median(told)))))
        here = ((bodies == number) & transport.lit).ravel()
        wide = here & np.any(_spread(boxes) > _spread(widest), axis=1)
        found[wide] = widest[wide]
    return found


def _spread(boxes: Floats) -> Floats:
    """Return the variance of footprints along each axis, projector pixels squared, (C, 2)."""
    return boxes[:, :2] ** 2 / 12 + boxes[:, 2:] ** 2
