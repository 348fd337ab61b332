"""Centroids of direct light among the entries of t about it.

Near-range light of a translucent surface has entries on all sides of direct light. It moves a
centroid wherever more of it counts on one side than on the other, as in any square of whole pixels
about a place that lies between them. So entries count by their distance from the centroid itself:
fully up to a projector pixel away, as far as direct light between two pixels goes, and not at all
from half a pixel further on.

Index convention: c runs over camera pixels, i over entries along one axis of a square.
"""

import numpy as np

from nearfar.arrays import Floats, Integers

# Projector pixels from the centroid up to which entries count fully, and from which they do not.
FULL_DISTANCE, LARGEST_DISTANCE = 1.0, 1.5
# Centroids are moved this many times, from where a matched filter has its maximum to half a pixel.
STEPS = 3


def centroids(entries: Floats, middles: Integers, around: Floats) -> Floats:
    """Return the centroids of direct light, shape (c, 2), float64, in projector pixels.

    Parameters
    ----------
    entries : ndarray, shape (c, i, i)
        Of t in squares about `middles`, none negative.
    middles : ndarray of int, shape (c, 2)
    around : ndarray, shape (c, 2)
        Where direct light is, to half a pixel. It stays there if no entry is close to it.
    """
    reach = entries.shape[1] // 2
    offsets = np.arange(-reach, reach + 1)
    found = np.asarray(around - middles, dtype=np.float64)
    for _ in range(STEPS):
        down, across = (_counted(offsets - found[:, axis, None]) for axis in (0, 1))
        of_rows = np.einsum("cij,cj->ci", entries, across) * down
        of_columns = np.einsum("cij,ci->cj", entries, down) * across
        total = of_rows.sum(axis=1)
        moved = np.stack([of_rows @ offsets, of_columns @ offsets], axis=1)
        moved /= np.where(total > 0, total, 1.0)[:, None]
        found = np.where((total > 0)[:, None], moved, found)
    return middles + found


def _counted(distances: Floats) -> Floats:
    """Return how much entries count at distances along one axis."""
    beyond = LARGEST_DISTANCE - np.abs(distances)
    return np.clip(beyond / (LARGEST_DISTANCE - FULL_DISTANCE), 0.0, 1.0)
