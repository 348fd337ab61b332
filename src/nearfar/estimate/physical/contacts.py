"""Opaque camera pixels where a translucent body touches something, taken for part of the body.

Beside a body, much of the light about q comes through the air from the body. A kernel fits it well
enough for the camera pixel to be taken for the body's own: its inter-reflection becomes subsurface
light. Two things tell it from the body. It has a smaller share of subsurface light than the body
has, and hardly any inter-reflection is left of what opaque camera pixels around it have.
"""

from dataclasses import replace

import numpy as np
from scipy import ndimage

from nearfar.arrays import Booleans, Floats, Integers
from nearfar.estimate.physical.cells import camera_pixels_to_a_cell
from nearfar.estimate.physical.split import DARK, PhysicalSplit, opaque
from nearfar.estimate.physical.translucent import SQUARE

# Subsurface light of a contact, at most: its share of all light and its amount, each relative to
# the median of the body's camera pixels within its outline.
MOST_SHARE, MOST_LIGHT = 0.4, 0.6
# Inter-reflection of a contact, relative to the mean of opaque camera pixels around it, at most.
MOST_INTERREFLECTION = 0.3
# Cells, as the camera sees them, up to which opaque camera pixels are around one, and how many of
# them there are at least. How all of these were chosen: docs/decisions/0115.
REACH = 3
LEAST_AROUND = 3


def without_contacts(split: PhysicalSplit) -> PhysicalSplit:
    """Return a split whose bodies end where they touch something opaque.

    Parameters
    ----------
    split : PhysicalSplit

    Returns
    -------
    PhysicalSplit
        Camera pixels that left a body have the transport's direct light and footprint.
    """
    transport = split.transport
    white = np.ones(transport.projector, dtype=np.float32)
    shape = transport.direct.shape
    of_light = (np.reshape(part, shape).sum(axis=-1) for part in split.components(white))
    direct, subsurface, interreflection = of_light
    share = subsurface / np.maximum(direct + subsurface + interreflection, DARK)
    # Comparisons with NaN are false: where nothing opaque is around.
    around = _mean_around(
        interreflection, opaque(split), REACH * camera_pixels_to_a_cell(transport)
    )
    dark = interreflection < MOST_INTERREFLECTION * around
    contacts = [_contacts(body.pixels, share, subsurface, dark) for body in split.bodies]
    bodies = (body.without(left) for body, left in zip(split.bodies, contacts, strict=True))
    left = np.flatnonzero(np.any(contacts, axis=0)) if contacts else np.empty(0, dtype=int)
    of_model = split.direct.reshape(-1, transport.channels).copy()
    of_model[left] = transport.direct.reshape(of_model.shape)[left]
    footprint = split.footprint
    if footprint is not None and transport.footprint is not None:
        footprint = footprint.copy()
        footprint.reshape(-1, 4)[left] = transport.footprint.reshape(-1, 4)[left]
    return replace(split, direct=of_model.reshape(shape), bodies=tuple(bodies), footprint=footprint)


def _contacts(pixels: Integers, share: Floats, subsurface: Floats, dark: Booleans) -> Booleans:
    """Return which camera pixels, flattened, are a body's contacts.

    They are reached from outside the body through nothing but contacts.
    """
    seen = np.zeros(dark.shape, dtype=bool)
    seen.ravel()[pixels] = True
    inner = ndimage.binary_erosion(seen, SQUARE)
    if not inner.any():
        return np.zeros(dark.size, dtype=bool)
    faint = seen & dark & (share < MOST_SHARE * np.median(share[inner]))
    faint &= subsurface < MOST_LIGHT * np.median(subsurface[inner])
    at_outline = faint & ndimage.binary_dilation(~seen, SQUARE)
    return np.asarray(ndimage.binary_propagation(at_outline, SQUARE, mask=faint).ravel())


def _mean_around(picture: Floats, chosen: Booleans, reach: int) -> Floats:
    """Return the mean over chosen camera pixels up to a reach; NaN where there are too few."""
    count, total = (
        ndimage.uniform_filter(values, 2 * reach + 1, output=np.float64, mode="constant")
        for values in (chosen.astype(np.float64), np.where(chosen, picture, 0.0))
    )
    known = count * (2 * reach + 1) ** 2 > LEAST_AROUND - 0.5
    unknown = np.full(picture.shape, np.nan)
    return np.asarray(np.divide(total, count, out=unknown, where=known))
