"""Projector pixels in a disc about q, or near a line: runs of pixels in the projector's rows.

A run is the first pixel of a row and the one after the last, between which sums along the row are
differences of two sums.

Index convention: c runs over camera pixels, row by row, y over projector rows.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.applications.run_loops import runs_of_bands, runs_of_discs
from nearfar.arrays import Floats, Integers, Size


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
        rows = self._rows(projector)
        first = np.empty(len(q), dtype=np.int32)
        starts, stops = (np.empty((len(q), rows), dtype=np.int32) for _ in range(2))
        runs_of_discs(q, self.radius, (projector.height, projector.width), first, starts, stops)
        return Runs(first, starts, stops)

    def lines(self, q: Floats, projector: Size) -> slice:
        """Return the projector rows of the runs of all camera pixels, q (n, 2)."""
        rows, down = self._rows(projector), q[np.isfinite(q).all(axis=1), 0].astype(np.float64)
        if not len(down):
            return slice(0, rows)
        reach = min(self.radius, 2.0 * projector.height)
        first, last = (
            int(np.clip(np.floor(end - reach), 0, projector.height - rows))
            for end in (down.min(), down.max())
        )
        return slice(first, last + rows)

    def _rows(self, projector: Size) -> int:
        # No more rows than a projector has.
        reach = int(np.ceil(min(self.radius, float(projector.height))))
        return min(2 * reach + 1, projector.height)


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
        lines = (self.fundamental @ np.stack([x, y, np.ones_like(x)])).T
        starts, stops = (np.empty((len(x), projector.height), dtype=np.int32) for _ in range(2))
        runs_of_bands(lines, self.width, (projector.height, projector.width), starts, stops)
        return Runs(np.zeros(len(x), dtype=np.int32), starts, stops)

    def lines(self, _q: Floats, projector: Size) -> slice:
        """Return the projector rows of the runs: all."""
        return slice(0, projector.height)
