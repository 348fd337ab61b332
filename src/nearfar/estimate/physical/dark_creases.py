"""Inter-reflection of translucent bodies, without the dark lines at their creases.

Right at a crease light comes from all sides: from across it, and from under the surface. Kernels
take both for subsurface light. As a share of the two, inter-reflection changes slowly over a body,
since albedo is in both.
"""

from dataclasses import replace

import numpy as np

from nearfar.estimate.physical.around import moved, steps
from nearfar.estimate.physical.cells import camera_pixels_to_a_cell
from nearfar.estimate.physical.split import PhysicalSplit, on_bodies

# Cells on each side whose camera pixels tell, and the share of them that a body must have there.
REACH, LEAST_SEEN = 2, 0.7
# The share is at least as high as that of so many of them.
AS_HIGH_AS = 0.5
# Subsurface light loses no more than this share of itself.
MOST = 0.5


def without_dark_creases(split: PhysicalSplit) -> PhysicalSplit:
    """Return a split whose inter-reflection on bodies is no lower than that of half about it.

    It is compared as a share of inter-reflection and subsurface light, under white; the latter has
    as much less.

    Parameters
    ----------
    split : PhysicalSplit

    Returns
    -------
    PhysicalSplit
    """
    transport = split.transport
    if not split.bodies:
        return split
    shape = (*transport.camera, transport.channels)
    white = np.ones(transport.projector, dtype=np.float32)
    _, subsurface, rest = (np.reshape(part, shape) for part in split.components(white))
    seen = on_bodies(split)
    known = seen[..., None] & (subsurface > 0) & (subsurface + rest > 0)
    share = np.full(shape, np.nan)
    np.divide(rest, subsurface + rest, out=share, where=known)
    pixels, channels = np.flatnonzero(seen), transport.channels
    about = camera_pixels_to_a_cell(transport) * steps(REACH)
    others = np.stack([moved(share, step, np.nan).reshape(-1, channels)[pixels] for step in about])
    others.sort(axis=0)
    count = np.sum(~np.isnan(others), axis=0)
    rank = np.maximum((AS_HIGH_AS * count).astype(int) - 1, 0)
    least = np.take_along_axis(others, rank[None], axis=0)[0]
    own = share.reshape(-1, channels)[pixels]
    # Comparisons with NaN are false: where a share is not known.
    raised = (count >= LEAST_SEEN * len(about)) & (least > own)
    # Subsurface light has the rest of the share.
    lost = np.zeros(own.shape)
    np.divide(least - own, 1 - own, out=lost, where=raised)
    kept = np.ones((transport.camera.pixels, channels))
    kept[pixels] = 1 - np.minimum(lost, MOST)
    bodies = (body._replace(amplitude=body.amplitude * kept[body.pixels]) for body in split.bodies)
    return replace(split, bodies=tuple(bodies))
