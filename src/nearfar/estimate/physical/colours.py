"""Subsurface light at the outlines of bodies, which has the colour of the body's.

A camera pixel there also sees what lies behind or beside the body, and a kernel takes some of its
light for the body's. Such light has the colour of that surface; in the channel in which it is
darkest there is least of it.
"""

from dataclasses import replace

import numpy as np
from scipy import ndimage

from nearfar.arrays import Floats
from nearfar.estimate.physical.split import PhysicalSplit, Translucent
from nearfar.estimate.physical.translucent import SQUARE

# Camera pixels on each side from which a colour is taken, those at the outline left out.
REACH = 3
# A channel may be brighter than the colour says by this factor.
UNLIKE = 1.3
# Amplitudes about an outline that are less, in photo units, have no colour.
LEAST = 1e-6


def with_colours_of_bodies(split: PhysicalSplit) -> PhysicalSplit:
    """Return a split whose subsurface light at outlines has the colour of the body's about it.

    What it has more is inter-reflection.

    Parameters
    ----------
    split : PhysicalSplit

    Returns
    -------
    PhysicalSplit
    """
    bodies = tuple(_coloured(split, body) for body in split.bodies)
    return replace(split, bodies=bodies)


def _coloured(split: PhysicalSplit, body: Translucent) -> Translucent:
    """Return a body whose amplitudes at the outline have the colour of those about them."""
    camera, channels = split.transport.camera, len(body.sources)
    seen = np.zeros(camera, dtype=bool)
    seen.ravel()[body.pixels] = True
    inner = ndimage.binary_erosion(seen, SQUARE)
    amplitude = np.zeros((*camera, channels))
    amplitude.reshape(-1, channels)[body.pixels] = body.amplitude
    colour = _means(amplitude * inner[..., None])
    outline = (seen & ~inner & (colour > LEAST).all(axis=-1)).ravel()[body.pixels]
    colour = colour.reshape(-1, channels)[body.pixels[outline]]
    changed = body.amplitude.copy()
    least = (changed[outline] / colour).min(axis=1, keepdims=True)
    changed[outline] = np.minimum(changed[outline], UNLIKE * least * colour)
    return body._replace(amplitude=changed)


def _means(picture: Floats) -> Floats:
    """Return means over the camera pixels about each, of each channel."""
    side = (2 * REACH + 1, 2 * REACH + 1, 1)
    return np.asarray(ndimage.uniform_filter(picture, side, mode="constant"))
