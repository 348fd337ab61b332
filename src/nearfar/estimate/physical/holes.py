"""Camera pixels whose q was not found, or not rightly, among others whose q was.

Few photos may not tell q, and the estimate then has no direct light, or that of a q which answers
alike. A camera pixel that is as bright as the eight around it, all of which see places in a plane,
sees the place in their middle: a shadow or another thing would rarely be as bright.
"""

from dataclasses import replace

import numpy as np

from nearfar.estimate.physical.around import moved, steps
from nearfar.estimate.physical.elsewhere import Elsewhere, sees_single_pixels
from nearfar.estimate.physical.split import PhysicalSplit

# Projector pixels that a q is off at least if it is another place's.
OFF = 3.0
# Root mean square of what the q of neighbours deviate from a plane, in projector pixels.
IN_A_PLANE = 0.3
# Of the light under white, how much less than the darkest of the eight, or more than the brightest.
AS_BRIGHT = 0.1


def without_holes(split: PhysicalSplit) -> PhysicalSplit:
    """Return a split with direct light where the estimate did not find q, or not rightly.

    Parameters
    ----------
    split : PhysicalSplit

    Returns
    -------
    PhysicalSplit
    """
    transport = split.transport
    shape = transport.direct.shape
    white = np.ones(transport.projector, dtype=np.float32)
    total = np.reshape(transport @ white, shape)
    direct = np.reshape(split.components(white).direct, shape)
    about, channels = steps(1), transport.channels
    lit = np.stack([moved(transport.lit, step, False) for step in about])
    pixels = np.flatnonzero(lit.all(axis=0) & sees_single_pixels(split.footprint, transport.camera))
    of_total, of_direct, of_places = (
        np.stack([moved(picture, step, 0.0).reshape(-1, size)[pixels] for step in about])
        for picture, size in ((total, channels), (direct, channels), (transport.correspondence, 2))
    )
    # A plane through the neighbours has the mean of their q in their middle.
    design = np.column_stack([np.ones(len(about)), about])
    fitted = np.einsum("ij,jca->ica", design @ np.linalg.pinv(design), of_places)
    apart = np.sqrt(np.mean((of_places - fitted) ** 2, axis=0)).max(axis=-1)
    light = total.reshape(-1, channels)[pixels]
    brightness, own = of_total.mean(axis=-1), light.mean(axis=-1)
    off = np.abs(transport.correspondence.reshape(-1, 2)[pixels] - of_places.mean(axis=0))
    wrong = ~transport.lit.ravel()[pixels] | (off.max(axis=-1) > OFF)
    bright = own > (1 - AS_BRIGHT) * brightness.min(axis=0)
    bright &= own < (1 + AS_BRIGHT) * brightness.max(axis=0)
    found = wrong & bright & (apart < IN_A_PLANE)
    share = np.median(of_direct / np.maximum(of_total, np.finfo(np.float32).tiny), axis=0)
    holes = Elsewhere(pixels, of_places.mean(axis=0), share * light).of(found)
    at_q = split.direct.reshape(-1, channels).copy()
    at_q[holes.pixels] = 0.0
    return replace(split, direct=at_q.reshape(shape), elsewhere=split.elsewhere.and_also(holes))
