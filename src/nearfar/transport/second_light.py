"""Direct light from a second place: camera pixels at outlines, which see two surfaces.

Few camera pixels have any, so that these alone are gone through.

Index convention: c runs over camera pixels, row by row.
"""

from dataclasses import dataclass, replace

import numpy as np

from nearfar.arrays import Floats, Integers, Size
from nearfar.transport import direct as footprints
from nearfar.transport.direct import Footprint


@dataclass(frozen=True, eq=False)
class SecondLight:
    """Direct light of n camera pixels from a second place.

    Attributes
    ----------
    pixels : ndarray of int, shape (n,)
        Camera pixels, ascending.
    direct : ndarray, shape (n, channels), float32
    where : Footprint
        2 x 2 projector pixels around each place, and their weights.
    """

    pixels: Integers
    direct: Floats
    where: Footprint

    def of(self, pixels: slice, count: int) -> "SecondLight":
        """Return those of some of `count` camera pixels, counted from the first of these."""
        first, stop, _ = pixels.indices(count)
        some = slice(*np.searchsorted(self.pixels, [first, stop]))
        where = Footprint(self.where.pixels[some], self.where.weights[some])
        return SecondLight(self.pixels[some] - first, self.direct[some], where)

    def of_channel(self, channel: int) -> "SecondLight":
        """Return the light of one channel."""
        return replace(self, direct=self.direct[:, channel : channel + 1])

    def add_pictures(self, lights: Floats, pictures: Floats) -> None:
        """Add the pictures (L, C, channels) under lights (L, 1 or channels, P)."""
        seen = np.moveaxis(footprints.look_up(lights, self.where), 1, 2)
        pictures[:, self.pixels] += seen * self.direct

    def back(self, image: Floats, channel: int, projector: Size) -> Floats:
        """Send one channel of an image (C,) back, (Py, Px)."""
        sent = image[self.pixels] * self.direct[:, channel]
        return footprints.spread(sent, self.where, projector).reshape(projector)

    def add_rows(self, rows: Floats) -> None:
        """Add to the rows of D of all camera pixels, (C, channels, P)."""
        for i in range(rows.shape[1]):
            light = self.where.weights * self.direct[:, i, None]
            # Corners may coincide at the border: add each on its own.
            np.add.at(rows[:, i], (self.pixels[:, None], self.where.pixels), light)


def second_light(places: Floats, direct: Floats, projector: Size) -> SecondLight:
    """Return the second direct light of camera pixels.

    Parameters
    ----------
    places : ndarray, shape (..., 2)
        NaN where there is none.
    direct : ndarray, shape (..., channels)
    projector : Size
    """
    flat = places.reshape(-1, 2)
    pixels = np.flatnonzero(np.isfinite(flat).all(axis=1))
    where = footprints.footprint(flat[pixels], projector)
    return SecondLight(pixels, direct.reshape(len(flat), direct.shape[-1])[pixels], where)
