"""Entries of t about the places of camera pixels, fitted to responses, none negative.

Index convention: c runs over camera pixels, o over the entries of a square.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Integers
from nearfar.correspondence.centroids import centroids
from nearfar.correspondence.nonnegative import nonnegative_entries
from nearfar.correspondence.weighing import Weighed
from nearfar.illumination.near_basis import window_offsets
from nearfar.illumination.real_basis import RealBasis

# Pixels on each side of the middle of a footprint.
FOOTPRINT_REACH = 2
SIDE = 2 * FOOTPRINT_REACH + 1
# Ridge on a footprint's entries two pixels from its middle, in units of the diagonal: a second
# pixel of direct light is more probable next to the first.
OUTER_RIDGE = 1.0
# Where responses of two entries are more alike, as a correlation, the entries are not told apart.
# The centroid of all of them is then known better than how much light each has. Sinusoids that
# `nearfar plan` chooses have 0.7 at most.
LARGEST_ALIKE = 0.8


class Entries(NamedTuple):
    """Entries of t about the places of camera pixels.

    Attributes
    ----------
    values : ndarray, shape (C, 5, 5)
        Of squares about whole projector pixels; none is negative.
    middles : ndarray of int, shape (C, 2)
        The projector pixel in the middle of each square.
    excess : ndarray, shape (C,)
        Root mean square over the responses of what the entries explain, in deviations of the
        background.
    alike : ndarray, shape (C,)
        Largest correlation of the weighted responses of the entry in the middle and another.
    """

    values: Floats
    middles: Integers
    excess: Floats
    alike: Floats


def entries_about(basis: RealBasis, weighed: Weighed, around: NDArray[np.float64]) -> Entries:
    """Fit the entries of t about places.

    Parameters
    ----------
    basis : RealBasis
        Of the responses, without DC.
    weighed : Weighed
        Responses of C camera pixels.
    around : ndarray, shape (C, 2)
        Projector pixels, not necessarily whole.

    Returns
    -------
    Entries
    """
    limit = np.array(basis.projector) - 1
    offsets = window_offsets(SIDE)
    centre = np.clip(np.floor(around + 0.5).astype(np.int64), 0, limit)
    # Two entries overlap by a sum that depends on the offset between them alone.
    steps = window_offsets(2 * SIDE - 1)
    overlap = np.cos(2 * np.pi * (basis.cycles @ steps.T)).astype(np.float32)
    apart = offsets[:, None] - offsets[None] + 2 * FOOTPRINT_REACH
    number = apart[..., 0] * (4 * FOOTPRINT_REACH + 1) + apart[..., 1]
    ridge = np.where(np.abs(offsets).max(axis=1) > 1, OUTER_RIDGE, 0.0).astype(np.float32)
    places = offsets[:, None] + centre
    inside: Booleans = np.all((places >= 0) & (places <= limit), axis=-1)
    phase_shifted = basis.recentre(weighed.responses[:, None], centre)[:, 0]
    scores = np.ascontiguousarray((phase_shifted @ basis.patterns_at(offsets)).T)
    gram = (overlap.T @ weighed.weights.T)[number]
    entries, explained = nonnegative_entries(scores, gram, inside, ridge)
    excess = np.sqrt(np.maximum(explained, 0.0) / basis.count)
    of_middle = np.abs(gram[len(gram) // 2])
    of_itself = np.maximum(of_middle[len(gram) // 2], np.finfo(np.float32).tiny)
    of_middle[len(gram) // 2] = 0.0
    alike = of_middle.max(axis=0) / of_itself
    return Entries(entries.T.reshape(-1, SIDE, SIDE), centre, excess, alike)


def places_among(seen: Entries, around: NDArray[np.float64]) -> Floats:
    """Return where the direct light among entries is, shape (C, 2), in projector pixels.

    Parameters
    ----------
    seen : Entries
    around : ndarray, shape (C, 2)
        The places that the entries lie about.
    """
    side = np.arange(-FOOTPRINT_REACH, FOOTPRINT_REACH + 1)
    total = seen.values.sum(axis=(1, 2))
    sums = np.stack([seen.values.sum(axis=axis) @ side for axis in (2, 1)], axis=1)
    of_all = seen.middles + sums / np.where(total > 0, total, 1.0)[:, None]
    of_direct = centroids(seen.values, seen.middles, around)
    return np.where((seen.alike > LARGEST_ALIKE)[:, None], of_all, of_direct)
