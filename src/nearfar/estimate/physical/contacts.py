"""Opaque camera pixels where a translucent body touches something, taken for part of the body.

Beside a body, much of the light about q comes through the air from the body. A kernel fits it well
enough for the camera pixel to be taken for the body's own: its inter-reflection becomes subsurface
light. Two things tell it from the body. It has a smaller share of subsurface light than the body
has, and hardly any inter-reflection is left of what opaque camera pixels around it have. Where
opaque things touch each other, in a narrow gap, kernels may find a whole body of the same kind.
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
MOST_INTERREFLECTION = 0.4
# The same of a whole body, in the median, and subsurface light's share of its light, at most: true
# bodies have more than half.
MOST_INTERREFLECTION_OF_BODY, MOST_SHARE_OF_BODY = 0.5, 0.3
# Cells, as the camera sees them, up to which opaque camera pixels are around one, and how many of
# them there are at least. How all of these were chosen: docs/decisions/0115.
REACH = 3
LEAST_AROUND = 3


def without_contacts(split: PhysicalSplit) -> PhysicalSplit:
    """Return a split whose bodies end where they touch something opaque, without such contacts.

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
    reach = REACH * camera_pixels_to_a_cell(transport)
    around = _mean_around(interreflection, opaque(split), reach)
    # Where nothing opaque is around, or it is dark, this is NaN, and comparisons are false.
    left_over = np.full(share.shape, np.nan)
    np.divide(interreflection, around, out=left_over, where=around > 0)
    contacts = [_contacts(body.pixels, share, subsurface, left_over) for body in split.bodies]
    ended = (body.without(left) for body, left in zip(split.bodies, contacts, strict=True))
    bodies = (body for body in ended if len(body.pixels))
    left = np.flatnonzero(np.any(contacts, axis=0)) if contacts else np.empty(0, dtype=int)
    of_model = split.direct.reshape(-1, transport.channels).copy()
    of_model[left] = transport.direct.reshape(of_model.shape)[left]
    footprint = split.footprint
    if footprint is not None and transport.footprint is not None:
        footprint = footprint.copy()
        footprint.reshape(-1, 4)[left] = transport.footprint.reshape(-1, 4)[left]
    return replace(split, direct=of_model.reshape(shape), bodies=tuple(bodies), footprint=footprint)


def _contacts(pixels: Integers, share: Floats, subsurface: Floats, left_over: Floats) -> Booleans:
    """Return which camera pixels, flattened, are a body's contacts: all of one that is no body.

    They are reached from outside the body through nothing but contacts.

    Parameters
    ----------
    pixels : ndarray of int, shape (n,)
        The body's.
    share, subsurface, left_over : ndarray, shape (Cy, Cx)
        Subsurface light as a share of all light, its amount, and inter-reflection relative to that
        around.
    """
    seen = np.zeros(share.shape, dtype=bool)
    seen.ravel()[pixels] = True
    known = left_over[seen & np.isfinite(left_over)]
    if (
        known.size
        and np.median(known) < MOST_INTERREFLECTION_OF_BODY
        and np.median(share[seen]) < MOST_SHARE_OF_BODY
    ):
        return seen.ravel()
    inner = ndimage.binary_erosion(seen, SQUARE)
    if not inner.any():
        return np.zeros(seen.size, dtype=bool)
    faint = seen & (left_over < MOST_INTERREFLECTION)
    faint &= share < MOST_SHARE * np.median(share[inner])
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
