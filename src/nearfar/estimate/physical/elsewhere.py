"""Direct light of camera pixels that comes from another place than q.

Index convention: e runs over pairs of a camera pixel and another place.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, Size
from nearfar.transport.direct import footprint, look_up
from nearfar.transport.model import Transport

# Wider footprints are of several projector pixels; light from elsewhere is of one.
SINGLE_PIXEL = 1.2


class Elsewhere(NamedTuple):
    """Direct light from other places than q.

    Attributes
    ----------
    pixels : ndarray of int, shape (n,)
        Camera pixels, flattened row by row; each at most once.
    places : ndarray, shape (n, 2)
        (y, x) on the projector.
    direct : ndarray, shape (n, channels)
        Direct light from there under white.
    """

    pixels: Integers
    places: Floats
    direct: Floats

    def under(self, lights: Floats, projector: Size) -> Floats:
        """Return it under a light, shape (n, channels).

        Parameters
        ----------
        lights : ndarray, shape (1 or channels, P)
            Flat, of each channel or of all.
        projector : Size
        """
        where = footprint(self.places, projector)
        return self.direct * np.atleast_2d(look_up(lights, where)).T

    def of(self, chosen: Integers | Booleans) -> "Elsewhere":
        """Return those of some entries, by index or as a mask."""
        return Elsewhere(self.pixels[chosen], self.places[chosen], self.direct[chosen])

    def and_also(self, others: "Elsewhere") -> "Elsewhere":
        """Return these and others; where both have a camera pixel, the others'."""
        mine = self.of(~np.isin(self.pixels, others.pixels))
        return Elsewhere(*(np.concatenate(both) for both in zip(mine, others, strict=True)))


def at_second_places(transport: Transport) -> Elsewhere:
    """Return the direct light of a transport that comes from second places."""
    second, places = transport.factors.second, transport.second_place
    if second is None or places is None:
        return nowhere(transport.channels)
    return Elsewhere(second.pixels, places.reshape(-1, 2)[second.pixels], second.direct)


def nowhere(channels: int) -> Elsewhere:
    """Return no direct light at all."""
    return Elsewhere(np.empty(0, dtype=np.int64), np.empty((0, 2)), np.empty((0, channels)))


def sees_single_pixels(footprint: Floats | None, camera: Size) -> Booleans:
    """Return whether direct light's footprint is of one projector pixel, shape (Cy, Cx).

    Parameters
    ----------
    footprint : ndarray, shape (Cy, Cx, 4), or None
        As `Transport.footprint`.
    camera : Size
    """
    if footprint is None:
        return np.ones(camera, dtype=bool)
    return np.asarray(np.all(footprint[..., :2] < SINGLE_PIXEL, axis=-1))
