"""Inter-reflection of translucent bodies is nowhere far below what it is on the rest of the body.

It is what direct and subsurface light leave. Where kernels take too much for subsurface light,
little or less than nothing is left, and a body has a dark spot of an odd colour. The share that
inter-reflection has of a body's light changes from place to place, but hardly comes near none.
"""

from dataclasses import replace

import numpy as np

from nearfar.estimate.physical.split import DARK, PhysicalSplit

# Of the median over the body, the share of light that inter-reflection has at least.
LEAST_OF_MEDIAN = 0.3


def with_least_interreflection(split: PhysicalSplit) -> PhysicalSplit:
    """Return a split whose bodies give up subsurface light where too little inter-reflection is.

    Parameters
    ----------
    split : PhysicalSplit

    Returns
    -------
    PhysicalSplit
        Direct light is as before, and no subsurface light is negative.
    """
    if not split.bodies:
        return split
    transport = split.transport
    white = np.ones(transport.projector, dtype=np.float32)
    shape = (transport.camera.pixels, transport.channels)
    parts = [np.reshape(part, shape) for part in split.components(white)]
    total = np.maximum(np.asarray(sum(parts)), DARK)
    bodies = []
    for body in split.bodies:
        of_body = total[body.pixels]
        subsurface, interreflection = (part[body.pixels] for part in parts[1:])
        median = np.median(interreflection / of_body, axis=0)
        missing = LEAST_OF_MEDIAN * median * of_body - interreflection
        taken = np.clip(missing, 0.0, np.maximum(subsurface, 0.0))
        kept = np.ones_like(taken)
        np.divide(subsurface - taken, subsurface, out=kept, where=taken > 0)
        bodies.append(body._replace(amplitude=body.amplitude * kept))
    return replace(split, bodies=tuple(bodies))
