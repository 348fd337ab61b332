"""Tiles of camera rows: as many rows as fit in the memory, and those beside them that they need."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Size, blocks
from nearfar.errors import InputError
from nearfar.estimate.base import Estimator
from nearfar.plan import Plan

# Bytes that Python and the libraries take.
LIBRARY_BYTES = 4 * 10**8
# Arrays that come and go take so many times the bytes of those that are counted.
TEMPORARY_FACTOR = 1.5
# Tiles of so many rows twice over, or more, are of a multiple of them: chunks in a file divide
# tiles, and need not be small.
ROWS_MULTIPLE = 8
# Bytes of each value of the camera that references take: mean white and black, and whether white
# is saturated.
REFERENCE_BYTES_PER_VALUE = 9


class Tiling(NamedTuple):
    """How the camera's rows are cut into tiles.

    Attributes
    ----------
    height : int
        Rows of the camera.
    rows : int
        Rows of a tile.
    halo : int
        Rows on either side of a tile that its result depends on.
    """

    height: int
    rows: int
    halo: int

    def tiles(self) -> Iterator[slice]:
        """Yield the rows of each tile, in order."""
        return blocks(self.height, self.rows)

    def with_halo(self, tile: slice) -> slice:
        """Return the rows of a tile and of its halo."""
        return slice(max(0, tile.start - self.halo), min(self.height, tile.stop + self.halo))


def tile_rows(
    plan: Plan, camera: Size, channels: int, estimator: Estimator, halo: int, memory: int
) -> Tiling:
    """Cut a camera's rows into tiles that may be worked at in so many bytes.

    Parameters
    ----------
    plan : Plan
    camera : Size
    channels : int
    estimator : Estimator
    halo : int
        Rows on either side of a tile that its result depends on.
    memory : int
        Bytes.

    Raises
    ------
    InputError
        If not even one row fits.
    """
    shared, row = _shared_and_row(plan, camera, channels, estimator)
    beside = _rows_beside(estimator)
    rows = int((memory - shared) / row) - beside
    if rows + beside >= camera.height:
        return Tiling(camera.height, camera.height, halo)
    if rows < 1:
        least = memory_of_tile(plan, camera, channels, estimator, min(1, camera.height - beside))
        raise InputError(
            f"{memory / 1e6:.0f} MB of memory are too few for one row of these photos: give "
            f"`memory={int(np.ceil(least / 1e8)) * 10**8}` or more."
        )
    rows = rows if rows < 2 * ROWS_MULTIPLE else rows - rows % ROWS_MULTIPLE
    return Tiling(camera.height, rows, halo)


def memory_of_tile(
    plan: Plan, camera: Size, channels: int, estimator: Estimator, rows: int
) -> float:
    """Return the bytes in which a tile of so many rows is worked at."""
    shared, row = _shared_and_row(plan, camera, channels, estimator)
    return shared + row * (rows + _rows_beside(estimator))


def rows_to_measure(
    plan: Plan, camera: Size, channels: int, estimator: Estimator, memory: int
) -> int:
    """Return how many camera rows are measured at once in so many bytes, at least one."""
    shared, row = _shared_and_row(plan, camera, channels, estimator)
    return min(camera.height, max(1, int((memory - shared) / row)))


def reference_bytes(plan: Plan, camera: Size, channels: int) -> int:
    """Return the bytes of what references tell of the whole camera, none for other plans."""
    return REFERENCE_BYTES_PER_VALUE * camera.pixels * channels if plan.offset == "reference" else 0


def _shared_and_row(
    plan: Plan, camera: Size, channels: int, estimator: Estimator
) -> tuple[float, float]:
    """Return the bytes that all rows share, and those of a row."""
    shared, pixel = estimator.memory(plan, channels)
    shared += LIBRARY_BYTES + reference_bytes(plan, camera, channels)
    return shared, TEMPORARY_FACTOR * pixel * camera.width


def _rows_beside(estimator: Estimator) -> int:
    # One more on either side for correspondence by phase.
    return 2 * (estimator.halo + 1) if estimator.halo else 0
