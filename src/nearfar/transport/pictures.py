"""Pictures of d, n and f under many lights, for which each factor is read once.

Index convention: c runs over camera pixels, i over channels, l over lights, w over window entries;
lights are (L, 1, P) for all channels, or (L, channels, P); pictures are (L, C, channels).
"""

import math

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size, blocks
from nearfar.parallel import side_by_side
from nearfar.transport import direct as footprints
from nearfar.transport import near as windows
from nearfar.transport.direct import Footprint

# Camera pixels of a batch: their windows stay in the processor's cache while lights change.
BATCH_PIXELS = 1024
# With a smaller share of lit windows, the lit ones are copied and multiplied alone; with a larger
# one, copying takes longer than multiplying the dark ones too.
DENSE_SHARE = 0.6
# With fewer lights, starting threads takes longer than the work.
MINIMUM_LIGHTS_FOR_THREADS = 8


def direct_pictures(direct: Floats, where: Footprint, lights: Floats) -> Floats:
    """Return the pictures (L, C, channels) of d, shape (C, channels), at footprints."""
    return np.asarray(np.moveaxis(footprints.look_up(lights, where), 1, 2) * direct)


def near_pictures(
    near: Floats, centres: NDArray[np.int64], projector: Size, lights: Floats
) -> Floats:
    """Return the pictures (L, C, channels) of n, shape (C, channels, W^2), around centres."""
    window = round(np.sqrt(near.shape[2]))
    found = np.zeros((len(lights), *near.shape[:2]), dtype=np.result_type(lights, near))
    if not window:
        return found
    padded = windows.pad(lights.reshape(*lights.shape[:2], *projector), window)
    lit = [windows.reached(light.any(axis=0), centres, window) for light in padded]

    def work(batch: slice) -> None:
        for number, light in enumerate(padded):
            chosen: slice | NDArray[np.int64] = batch
            reached = lit[number][batch]
            if np.count_nonzero(reached) < DENSE_SHARE * reached.size:
                # A small light: most windows are dark.
                found[number, batch] = 0.0
                if not reached.any():
                    continue
                chosen = batch.start + np.flatnonzero(reached)
            seen = [windows.read(channel, centres[chosen], window) for channel in light]
            if len(seen) == 1:
                found[number, chosen] = np.einsum("ciw,cw->ci", near[chosen], seen[0])
            else:
                for i, own in enumerate(seen):
                    found[number, chosen, i] = np.einsum("cw,cw->c", near[chosen, i], own)

    if len(lights) < MINIMUM_LIGHTS_FOR_THREADS:
        for batch in blocks(len(near), BATCH_PIXELS):
            work(batch)
    else:
        side_by_side(work, blocks(len(near), BATCH_PIXELS))
    return found


def far_pictures(far: Floats, overlaps: Floats) -> Floats:
    """Return the pictures (L, C, channels) of f.

    Parameters
    ----------
    far : ndarray, shape (C, channels, M)
        Responses to a basis.
    overlaps : ndarray, shape (L, 1 or channels, M)
        What `RealBasis.analyse` returns of lights.
    """
    overlaps = overlaps.astype(np.result_type(overlaps, far), copy=False)
    if overlaps.shape[1] == 1:
        flat = far.reshape(math.prod(far.shape[:2]), far.shape[2]) @ overlaps[:, 0].T
        return np.asarray(np.moveaxis(flat.reshape(*far.shape[:2], len(overlaps)), 2, 0))
    return np.asarray(np.einsum("cim,lim->lci", far, overlaps, optimize=True))
