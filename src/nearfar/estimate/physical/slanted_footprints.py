"""Direct light of slanted footprints, of which a part lies beside the projector pixels about q.

What lights a camera pixel is a parallelogram about q, whose sides are how far q moves from one
camera pixel to the next. On a floor seen from another side than it is lit from, the parallelogram
is a projector pixel large but two wide. An estimate takes direct light to come from the 2 x 2
projector pixels about q. It finds the less of it the less these look like the parallelogram, and
takes the rest for light next to q. How much that is follows from q alone.

Index convention: n runs over slanted camera pixels; about each are four projector pixels.
"""

from dataclasses import replace

import numpy as np

from nearfar.arrays import Floats
from nearfar.estimate.physical.rows_about import light_next_to_q
from nearfar.estimate.physical.slants import SlantedFootprints, slanted_footprints
from nearfar.estimate.physical.split import PhysicalSplit, opaque
from nearfar.transport.direct import footprint

# Share of inter-reflection that may be direct light.
MOST_OF_INTERREFLECTION = 0.3


def with_slanted_footprints(split: PhysicalSplit) -> PhysicalSplit:
    """Return a split in which direct light of opaque surfaces is all of a slanted footprint's.

    Parameters
    ----------
    split : PhysicalSplit

    Returns
    -------
    PhysicalSplit
        What direct light gains is no more than the light next to q, where that is known.
    """
    transport = split.transport
    slanted = slanted_footprints(transport, opaque(split).ravel())
    if not len(slanted.pixels):
        return split
    lost_of_found = np.zeros(transport.camera.pixels)
    lost_of_found[slanted.pixels] = 1 / _share_found(slanted) - 1
    chosen = np.zeros(transport.camera.pixels, dtype=bool)
    chosen[slanted.pixels] = True
    lost = np.maximum(lost_of_found, 0.0).reshape(transport.camera)[..., None] * split.direct
    white = np.ones(transport.projector, dtype=np.float32)
    interreflection = split.components(white).interreflection.reshape(lost.shape)
    most = MOST_OF_INTERREFLECTION * interreflection
    gain = np.clip(
        lost,
        0.0,
        np.maximum(
            np.fmin(light_next_to_q(transport, chosen.reshape(transport.camera)), most), 0.0
        ),
    )
    return replace(split, direct=split.direct + gain.astype(np.float32))


def _share_found(slanted: SlantedFootprints) -> Floats:
    """Return the share of direct light that an estimate finds, (n,).

    It is that whose light from the projector pixels about q is the nearest to the footprint's, in
    the sense of least squares.
    """
    about = footprint(slanted.q, slanted.projector)
    places = np.stack(np.divmod(about.pixels, slanted.projector.width), axis=-1)
    seen = slanted.shares_on(places)
    return np.asarray(np.sum(about.weights * seen, axis=1) / np.sum(about.weights**2, axis=1))
