"""Tiles of camera rows: how many rows fit in the memory, and the halo that a tile needs."""

from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Size, blocks
from nearfar.correspondence.methods import method_of
from nearfar.errors import InputError
from nearfar.estimate.base import Estimator
from nearfar.plan import Plan
from nearfar.plan.patterns import Stripe

# Memory of Python and the libraries.
LIBRARY_BYTES = 4 * 10**8
# Tiles of at least twice this many rows have a multiple of it: the rows of a chunk in the file must
# divide those of a tile, and a prime number of rows would leave chunks of one row.
ROWS_MULTIPLE = 8
# Memory of the references for each camera pixel and channel: mean white and black as float32, and
# a flag of saturated white.
REFERENCE_BYTES_PER_VALUE = 9
# Memory of a photo of a stripe for each camera pixel, summed over channels, as float32, with
# temporary arrays.
BYTES_PER_STRIPE = 6


class Tiling(NamedTuple):
    """How the rows of the camera are divided into tiles.

    Attributes
    ----------
    height : int
        Rows of the camera.
    rows : int
        Rows of a tile.
    halo : int
        Rows on each side of a tile that its result also depends on.
    """

    height: int
    rows: int
    halo: int

    def tiles(self) -> Iterator[slice]:
        """Yield the rows of each tile, in order."""
        return blocks(self.height, self.rows)

    def with_halo(self, tile: slice) -> slice:
        """Return the rows of a tile and of its halo, which begin at an even row.

        The joint estimate takes every other camera pixel by turns, of a tile as of the whole.
        """
        first = (tile.start - self.halo) // 2 * 2
        return slice(max(0, first), min(self.height, tile.stop + self.halo))


def tile_rows(
    plan: Plan,
    camera: Size,
    channels: int,
    estimator: Estimator,
    halo: int,
    memory: int,
    tiles_at_once: int = 1,
) -> Tiling:
    """Divide the rows of a camera into tiles that are reconstructed within `memory`.

    Parameters
    ----------
    plan : Plan
    camera : Size
    channels : int
    estimator : Estimator
    halo : int
        Rows on each side of a tile that its result also depends on.
    memory : int
        In bytes.
    tiles_at_once : int
        Tiles that share the memory.

    Raises
    ------
    InputError
        If not even one row fits.
    """
    shared, row = _shared_and_row(plan, camera, channels, estimator)
    halo_rows = _halo_rows(plan, estimator)
    rows = int((memory // tiles_at_once - shared) / row) - halo_rows
    if rows + halo_rows >= camera.height:
        return Tiling(camera.height, camera.height, halo)
    if rows < 1:
        least = memory_of_tile(plan, camera, channels, estimator, min(1, camera.height - halo_rows))
        enough = int(np.ceil(tiles_at_once * least / 1e8)) * 10**8
        each = f" in each of {tiles_at_once} tiles at once" if tiles_at_once > 1 else ""
        raise InputError(
            f"{memory / 1e6:.0f} MB of memory is too little for one row of these photos{each}: "
            f"give `memory={enough}` or more."
        )
    rows = rows if rows < 2 * ROWS_MULTIPLE else rows - rows % ROWS_MULTIPLE
    return Tiling(camera.height, rows, halo)


def memory_of_tile(
    plan: Plan, camera: Size, channels: int, estimator: Estimator, rows: int
) -> float:
    """Return the memory in bytes in which a tile of `rows` rows is reconstructed."""
    shared, row = _shared_and_row(plan, camera, channels, estimator)
    return shared + row * (rows + _halo_rows(plan, estimator))


def rows_to_measure(
    plan: Plan, camera: Size, channels: int, estimator: Estimator, memory: int
) -> int:
    """Return how many camera rows can be measured at once within `memory` bytes, at least one."""
    shared, row = _shared_and_row(plan, camera, channels, estimator)
    return min(camera.height, max(1, int((memory - shared) / row)))


def reference_bytes(plan: Plan, camera: Size, channels: int) -> int:
    """Return the memory in bytes of the references of the whole camera; 0 without references."""
    return REFERENCE_BYTES_PER_VALUE * camera.pixels * channels if plan.offset == "reference" else 0


def _shared_and_row(
    plan: Plan, camera: Size, channels: int, estimator: Estimator
) -> tuple[float, float]:
    """Return the memory in bytes that all rows share, and that of one row."""
    counted = estimator.memory(plan, channels)
    shared, pixel = float(counted.shared), counted.peak_factor * counted.pixel
    shared += LIBRARY_BYTES + reference_bytes(plan, camera, channels)
    if plan.offset != "inverse":
        # Where there are pairs, estimators count all photos, stripes among them.
        pixel += BYTES_PER_STRIPE * _stripes_at_once(plan)
    return shared, pixel * camera.width


def _stripes_at_once(plan: Plan) -> int:
    """Return how many photos of stripes are in memory while q is found in them."""
    kinds = Counter(pattern.kind for pattern in plan.patterns if isinstance(pattern, Stripe))
    return max(kinds.values(), default=0)


def _halo_rows(plan: Plan, estimator: Estimator) -> int:
    """Return the rows that are measured besides those of a tile."""
    beside = max(1, method_of(plan).rows_needed(plan))
    # A single one for correspondence is not counted where the estimator needs none.
    halo = estimator.rows_beside(plan)
    return 2 * (halo + beside) if halo or beside > 1 else 0
