"""Pictures under many lights: each factor is read once for all of them.

Index convention: c runs over camera pixels, i over channels, l over lights, w over window entries;
lights are (L, 1, P) for all channels, or (L, channels, P); pictures are (L, C, channels).
"""

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size, blocks
from nearfar.illumination.real_basis import RealBasis
from nearfar.parallel import side_by_side
from nearfar.transport import direct as footprints
from nearfar.transport import near as windows
from nearfar.transport.direct import Footprint

# Camera pixels at once: their windows stay near the processor while lights change.
BLOCK = 1024
# Where fewer windows see light than this share, the rest are left out: they are copied for it.
MOSTLY = 0.6
# Fewer lights are done before threads have started.
FEW = 8


def direct_pictures(direct: Floats, where: Footprint, lights: Floats) -> Floats:
    """Pictures of d, shape (C, channels), spread over footprints."""
    return np.asarray(np.moveaxis(footprints.look_up(lights, where), 1, 2) * direct)


def near_pictures(
    near: Floats, centres: NDArray[np.int64], projector: Size, lights: Floats
) -> Floats:
    """Pictures of n, shape (C, channels, W^2), over windows about centres."""
    window = round(np.sqrt(near.shape[2]))
    found = np.empty((len(lights), *near.shape[:2]), dtype=np.result_type(lights, near))
    padded = windows.pad(lights.reshape(*lights.shape[:2], *projector), window)
    lit = [windows.reached(light.any(axis=0), centres, window) for light in padded]

    def work(block: slice) -> None:
        for number, light in enumerate(padded):
            chosen: slice | NDArray[np.int64] = block
            reached = lit[number][block]
            if np.count_nonzero(reached) < MOSTLY * reached.size:
                # A small light: most windows are dark.
                found[number, block] = 0.0
                if not reached.any():
                    continue
                chosen = block.start + np.flatnonzero(reached)
            seen = [windows.read(channel, centres[chosen], window) for channel in light]
            if len(seen) == 1:
                found[number, chosen] = np.einsum("ciw,cw->ci", near[chosen], seen[0])
            else:
                for i, own in enumerate(seen):
                    found[number, chosen, i] = np.einsum("cw,cw->c", near[chosen, i], own)

    if len(lights) < FEW:
        for block in blocks(len(near), BLOCK):
            work(block)
    else:
        side_by_side(work, blocks(len(near), BLOCK))
    return found


def far_pictures(far: Floats, basis: RealBasis, lights: Floats) -> Floats:
    """Pictures of f, shape (C, channels, M), the responses to a basis."""
    overlaps = basis.analyse(lights).astype(np.result_type(lights, far), copy=False)
    if lights.shape[1] == 1:
        flat = far.reshape(-1, basis.count) @ overlaps[:, 0].T
        return np.asarray(np.moveaxis(flat.reshape(*far.shape[:2], len(lights)), 2, 0))
    return np.asarray(np.einsum("cim,lim->lci", far, overlaps, optimize=True))
