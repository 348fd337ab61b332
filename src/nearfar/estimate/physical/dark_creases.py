"""Inter-reflection of translucent bodies, without the dark lines at their creases.

Right at a crease light comes from all sides: from across it, and from under the surface. Kernels
take both for subsurface light. As a share of the two, inter-reflection changes slowly over a body,
since albedo is in both.
"""

from dataclasses import replace

import numpy as np

from nearfar.estimate.physical.around import moved, steps
from nearfar.estimate.physical.cells import camera_pixels_to_a_cell
from nearfar.estimate.physical.split import PhysicalSplit

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
    seen = np.zeros(transport.camera, dtype=bool)
    for body in split.bodies:
        seen.ravel()[body.pixels] = True
    known = seen[..., None] & (subsurface > 0) & (subsurface + rest > 0)
    share = np.full(shape, np.nan)
    np.divide(rest, subsurface + rest, out=share, where=known)
    about = camera_pixels_to_a_cell(transport) * steps(REACH)
    others = np.sort(np.stack([moved(share, step, np.nan) for step in about]), axis=0)
    count = np.sum(~np.isnan(others), axis=0)
    rank = np.maximum((AS_HIGH_AS * count).astype(int) - 1, 0)
    least = np.take_along_axis(others, rank[None], axis=0)[0]
    raised = known & (count >= LEAST_SEEN * len(about)) & (least > share)
    more = np.where(raised, least - share, 0.0) * (subsurface + rest)
    kept = 1 - np.minimum(np.divide(more, subsurface, out=np.zeros(shape), where=known), MOST)
    flat = kept.reshape(-1, transport.channels)
    bodies = (body._replace(amplitude=body.amplitude * flat[body.pixels]) for body in split.bodies)
    return replace(split, bodies=tuple(bodies))
