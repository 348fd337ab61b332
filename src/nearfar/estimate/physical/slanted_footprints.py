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

from nearfar.arrays import Floats, Size
from nearfar.estimate.physical.rows_about import light_next_to_q
from nearfar.estimate.physical.split import PhysicalSplit, opaque
from nearfar.transport.boxes import LEAST_WIDTH
from nearfar.transport.direct import footprint
from nearfar.transport.seen import seen_of_projector

# Height or width of a slanted footprint, in projector pixels.
LEAST_EXTENT, LARGEST_EXTENT = 1.2, 4.0
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
    chosen = opaque(split).ravel() & ~transport.boxes.any(axis=1)
    boxes = seen_of_projector(transport.correspondence)
    extents = boxes[:, :2] + 2 * np.abs(boxes[:, 2:])
    chosen &= (extents.max(axis=1) >= LEAST_EXTENT) & (extents.max(axis=1) <= LARGEST_EXTENT)
    if not chosen.any():
        return split
    q, found = transport.correspondence.reshape(-1, 2), np.ones(len(chosen))
    found[chosen] = _share_found(q[chosen], boxes[chosen], transport.projector)
    # Of a q beyond the projector's border nothing may be found.
    of_found = np.divide(1 - found, found, out=np.zeros_like(found), where=found > 0)
    lost = np.maximum(of_found, 0.0).reshape(transport.camera)[..., None] * split.direct
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


def _share_found(q: Floats, boxes: Floats, projector: Size) -> Floats:
    """Return the share of direct light that an estimate finds, (n,).

    It is that whose light from the projector pixels about q is the nearest to the footprint's, in
    the sense of least squares.

    Parameters
    ----------
    q : ndarray, shape (n, 2)
    boxes : ndarray, shape (n, 4)
        The footprints, as `nearfar.transport.boxes` describes them.
    projector : Size
    """
    about = footprint(q, projector)
    pixels = np.stack(np.divmod(about.pixels, projector.width), axis=-1)
    edges = np.array(projector) - 0.5
    half = np.maximum(boxes[:, :2], LEAST_WIDTH) / 2
    covered, inside = np.zeros(pixels.shape[:2]), np.zeros(len(q))
    for side in (-1, 1):
        low, high = q + side * boxes[:, 2:] - half, q + side * boxes[:, 2:] + half
        last, first = high[:, None], low[:, None]
        along = np.minimum(last, pixels + 0.5) - np.maximum(first, pixels - 0.5)
        covered += np.clip(along, 0.0, None).prod(axis=-1)
        inside += np.clip(np.minimum(high, edges) - np.maximum(low, -0.5), 0.0, None).prod(axis=-1)
    seen = np.divide(
        covered, inside[:, None], out=np.zeros_like(covered), where=inside[:, None] > 0
    )
    return np.asarray(np.sum(about.weights * seen, axis=1) / np.sum(about.weights**2, axis=1))
