"""Direct light of slanted footprints, of which a part lies beside the projector pixels about q.

What lights a camera pixel is a parallelogram about q, whose sides are how far q moves from one
camera pixel to the next. On a floor seen from another side than it is lit from, the parallelogram
is a projector pixel large but two wide. An estimate takes direct light to come from the 2 x 2
projector pixels about q. It finds the less of it the less these look like the parallelogram, and
takes the rest for light next to q. How much that is follows from q alone.

Index convention: n runs over slanted camera pixels, s over samples of a camera pixel, k over the
projector pixels about q.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Integers, Size, blocks
from nearfar.estimate.physical.around import moved
from nearfar.estimate.physical.rows_about import light_next_to_q
from nearfar.estimate.physical.split import PhysicalSplit, opaque
from nearfar.transport.direct import footprint

# Height or width of a slanted footprint, at least, and sides of any, at most, in projector pixels.
LEAST_EXTENT, LONGEST_SIDE = 1.2, 3.0
# Where q moves by more or less on the other side of a camera pixel, it is at an outline.
LARGEST_BEND = 0.6
# Samples of a camera pixel down and across: with one odd number none lies between two projector
# pixels where q moves by whole ones.
SAMPLES = (32, 33)
# Share of inter-reflection that may be direct light.
MOST_OF_INTERREFLECTION = 0.3
BLOCK_PIXELS = 1024


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
    chosen = opaque(split) & ~transport.boxes.reshape(*transport.camera, 4).any(axis=-1)
    sides = _sides(transport.correspondence, transport.lit)
    # Without a known side this is NaN, and comparisons are false.
    chosen &= np.abs(sides).sum(axis=0).max(axis=-1) >= LEAST_EXTENT
    chosen &= np.abs(sides).max(axis=(0, -1)) <= LONGEST_SIDE
    pixels = np.flatnonzero(chosen)
    if not len(pixels):
        return split
    found = np.ones(transport.camera.pixels)
    q = transport.correspondence.reshape(-1, 2)
    for block in blocks(len(pixels), BLOCK_PIXELS):
        of_block = pixels[block]
        of_sides = sides.reshape(2, -1, 2)[:, of_block]
        found[of_block] = _share_found(q[of_block], of_sides, transport.projector)
    # Of a q beyond the projector's border nothing may be found.
    of_found = np.divide(1 - found, found, out=np.zeros_like(found), where=found > 0)
    lost = np.maximum(of_found, 0.0).reshape(transport.camera)[..., None] * split.direct
    white = np.ones(transport.projector, dtype=np.float32)
    interreflection = split.components(white).interreflection.reshape(lost.shape)
    most = MOST_OF_INTERREFLECTION * interreflection
    gain = np.clip(lost, 0.0, np.maximum(np.fmin(light_next_to_q(transport, chosen), most), 0.0))
    return replace(split, direct=split.direct + gain.astype(np.float32))


def _sides(correspondence: Floats, lit: Booleans) -> NDArray[np.float64]:
    """Return how far q moves a camera pixel down, and across: (2, Cy, Cx, 2).

    NaN where nothing is known of it, and where it moves otherwise on the other side.
    """
    q = np.where(lit[..., None], correspondence, np.nan).astype(np.float64)
    found = []
    for step in np.eye(2, dtype=np.int64):
        after, before = moved(q, step, np.nan) - q, q - moved(q, -step, np.nan)
        bent = np.any(np.abs(after - before) > LARGEST_BEND, axis=-1)
        either = np.where(np.isnan(after), before, after)
        side = np.where(np.isnan(after) | np.isnan(before), either, (after + before) / 2)
        found.append(np.where(bent[..., None], np.nan, side))
    return np.stack(found)


def _share_found(q: Floats, sides: Floats, projector: Size) -> Floats:
    """Return the share of direct light that an estimate finds, (n,).

    It is that whose light from the projector pixels about q is the nearest to the parallelogram's,
    in the sense of least squares.

    Parameters
    ----------
    q : ndarray, shape (n, 2)
    sides : ndarray, shape (2, n, 2)
        Of the parallelograms.
    projector : Size
    """
    sides_of_samples = ((np.arange(number) + 0.5) / number - 0.5 for number in SAMPLES)
    grid = np.meshgrid(*sides_of_samples, indexing="ij")
    down, across = (each.reshape(-1, 1) for each in grid)
    samples = q[:, None] + down * sides[0][:, None] + across * sides[1][:, None]
    nearest: Integers = np.rint(samples).astype(np.int64)
    inside = np.all((nearest >= 0) & (nearest < np.array(projector)), axis=-1)
    places = np.where(inside, nearest[..., 0] * projector.width + nearest[..., 1], -1)
    about = footprint(q, projector)
    on_projector = np.maximum(inside.sum(axis=1), 1)
    of_places = np.stack([np.sum(places == k[:, None], axis=1) for k in about.pixels.T], axis=-1)
    seen = of_places / on_projector[:, None]
    return np.asarray(np.sum(about.weights * seen, axis=1) / np.sum(about.weights**2, axis=1))
