"""Projector pixels in a disc about q, or near a line: runs of pixels in the projector's rows.

A run is the first pixel of a row and the one after the last, between which sums along the row are
differences of two sums.

Index convention: c runs over camera pixels, row by row, y over projector rows.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Integers, Size


class Runs(NamedTuple):
    """Projector pixels of camera pixels, a run in each of some projector rows.

    Attributes
    ----------
    first : ndarray of int32, shape (n,)
        First projector row of each camera pixel.
    starts, stops : ndarray of int32, shape (n, rows)
        First column, and the one after the last, in each row from the first; a run that stops
        where it starts is empty. Rows beyond the projector are empty.
    """

    first: Integers
    starts: Integers
    stops: Integers

    def drawn(self, projector: Size) -> NDArray[np.bool_]:
        """Return whether each projector pixel is in a run, shape (n, P)."""
        n, rows = self.starts.shape
        drawn = np.zeros((n, *projector), dtype=np.bool_)
        columns = np.arange(projector.width)
        for row in range(rows):
            inside = (self.starts[:, row, None] <= columns) & (columns < self.stops[:, row, None])
            y = self.first + row
            chosen = np.flatnonzero((y >= 0) & (y < projector.height))
            drawn[chosen, y[chosen]] = inside[chosen]
        return drawn.reshape(n, projector.pixels)


def _runs(first: Integers, starts: Floats, stops: Floats, projector: Size) -> Runs:
    """Return runs cut by the projector's border."""
    y = first[:, None] + np.arange(starts.shape[1])
    off = (y < 0) | (y >= projector.height)
    starts, stops = (np.clip(side, 0, projector.width) for side in (starts, stops))
    stops = np.where(off, starts, np.maximum(starts, stops))
    return Runs(first.astype(np.int32), starts.astype(np.int32), stops.astype(np.int32))


@dataclass(frozen=True)
class Disc:
    """Projector pixels nearer to q than `radius`; none without q, unless it is infinite."""

    radius: float

    def runs(self, pixels: slice, q: Floats, camera: Size, projector: Size) -> Runs:
        """Return the runs of camera pixels.

        Parameters
        ----------
        pixels : slice
        q : ndarray, shape (n, 2)
            Of these camera pixels.
        camera, projector : Size
        """
        lit: Booleans = np.asarray(np.isfinite(q).all(axis=1))
        places = np.where(lit[:, None], q, 0.0).astype(np.float64)
        # No more rows than a projector has.
        reach = min(self.radius, float(projector.height + projector.width))
        rows = min(2 * int(np.ceil(reach)) + 1, projector.height)
        first = np.clip(np.floor(places[:, 0] - reach), 0, projector.height - rows)
        down = first[:, None] + np.arange(rows) - places[:, :1]
        squared = self.radius**2 - down**2
        half = np.sqrt(np.maximum(squared, 0.0))
        found = lit[:, None] & (squared > 0)
        starts = np.floor(places[:, 1:] - half) + 1
        stops = np.where(found, np.ceil(places[:, 1:] + half), starts)
        return _runs(first.astype(np.int64), starts, stops, projector)


@dataclass(frozen=True, eq=False)
class Band:
    """Projector pixels at most half of `width` from the line of each camera pixel.

    Attributes
    ----------
    fundamental : ndarray, shape (3, 3), float64
        Projector line = fundamental @ (x_c, y_c, 1).
    width : float
    """

    fundamental: Floats
    width: float

    def runs(self, pixels: slice, q: Floats, camera: Size, projector: Size) -> Runs:
        """Return the runs of camera pixels; see `Disc.runs`."""
        y, x = np.divmod(np.arange(*pixels.indices(camera.pixels)), camera.width)
        a, b, c = self.fundamental @ np.stack([x, y, np.ones_like(x)])
        norm = np.hypot(a, b)
        known = norm > 0
        a, b, c = (np.divide(one, norm, where=known, out=np.zeros_like(norm)) for one in (a, b, c))
        rows = np.arange(projector.height)
        off = b[:, None] * rows + c[:, None]
        half = 0.5 * self.width
        # The columns x of a row with |a x + off| <= half; all or none of them if a is 0.
        slanted = np.abs(a) > np.finfo(np.float64).eps
        slope = np.where(slanted, a, 1.0)[:, None]
        ends = np.sort(np.stack([(-half - off) / slope, (half - off) / slope]), axis=0)
        whole = np.abs(off) <= half
        starts = np.where(slanted[:, None], np.ceil(ends[0]), 0.0)
        stops = np.where(slanted[:, None], np.floor(ends[1]) + 1, projector.width * whole)
        stops = np.where(known[:, None], stops, starts)
        return _runs(np.zeros(len(x), dtype=np.int64), starts, stops, projector)
