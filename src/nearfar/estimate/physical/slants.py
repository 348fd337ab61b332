"""Footprints that are slanted, from how far q moves from one camera pixel to the next.

Index convention: n runs over camera pixels whose footprint is slanted, m over projector pixels
about each, k over waves.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Complexes, Floats, Integers, Size
from nearfar.estimate.physical.responses import Waves
from nearfar.illumination.near_basis import window_offsets
from nearfar.transport.boxes import LEAST_WIDTH
from nearfar.transport.model import Transport
from nearfar.transport.seen import seen_of_projector

# Height or width of a slanted footprint, in projector pixels.
LEAST_EXTENT, LARGEST_EXTENT = 1.2, 4.0
# Projector pixels on each side of a rounded q that hold the largest.
REACH = 3


class SlantedFootprints(NamedTuple):
    """Footprints that are wider or higher than a projector pixel.

    Attributes
    ----------
    pixels : ndarray of int, shape (n,)
        The camera pixels, flattened row by row, rising.
    q : ndarray, shape (n, 2)
    boxes : ndarray, shape (n, 4)
        As `nearfar.transport.boxes` describes them.
    projector : Size
    """

    pixels: Integers
    q: Floats
    boxes: Floats
    projector: Size

    def shares_on(self, places: Integers) -> Floats:
        """Return the share of each footprint on projector pixels, (n, m).

        What lies beyond the projector's border is no part of a footprint.

        Parameters
        ----------
        places : ndarray of int, shape (n, m, 2)
        """
        edges = np.array(self.projector) - 0.5
        half = np.maximum(self.boxes[:, :2], LEAST_WIDTH) / 2
        covered, inside = np.zeros(places.shape[:2]), np.zeros(len(self.q))
        for side in (-1, 1):
            middle = self.q + side * self.boxes[:, 2:]
            low, high = middle - half, middle + half
            last, first = high[:, None], low[:, None]
            along = np.minimum(last, places + 0.5) - np.maximum(first, places - 0.5)
            covered += np.clip(along, 0.0, None).prod(axis=-1)
            within = np.minimum(high, edges) - np.maximum(low, -0.5)
            inside += np.clip(within, 0.0, None).prod(axis=-1)
        return np.asarray(covered / inside[:, None])

    def to_waves(self, rounded: Integers, waves: Waves) -> Complexes:
        """Return the responses of unit direct light to waves, (n, k), complex.

        Parameters
        ----------
        rounded : ndarray of int, shape (n, 2)
            Projector pixels next to q, whose phase is taken out of the responses.
        waves : Waves
        """
        offsets = window_offsets(2 * REACH + 1)
        places = rounded[:, None] + offsets
        on_projector = np.all((places >= 0) & (places < np.array(self.projector)), axis=-1)
        return np.asarray((self.shares_on(places) * on_projector) @ waves.at(offsets))


def slanted_footprints(transport: Transport, chosen: Booleans) -> SlantedFootprints:
    """Return the slanted footprints of chosen camera pixels, (C,).

    Camera pixels whose footprint the transport has as boxes are not among them, nor those whose q
    lies beyond the projector.
    """
    boxes = seen_of_projector(transport.correspondence)
    extent = (boxes[:, :2] + 2 * np.abs(boxes[:, 2:])).max(axis=1)
    known = transport.boxes.any(axis=1)
    q = transport.correspondence.reshape(-1, 2)
    lit = np.all((q >= -0.5) & (q <= np.array(transport.projector) - 0.5), axis=1)
    slanted = chosen & lit & ~known & (extent >= LEAST_EXTENT) & (extent <= LARGEST_EXTENT)
    pixels = np.flatnonzero(slanted)
    return SlantedFootprints(pixels, q[pixels], boxes[pixels], transport.projector)
