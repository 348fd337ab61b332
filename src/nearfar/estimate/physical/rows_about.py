"""Rows of a transport about q, on a grid of offsets.

Index convention: c runs over chosen camera pixels, o over a square of (2 REACH + 1)^2 offsets from
the rounded q, row by row.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Integers, blocks
from nearfar.illumination.near_basis import window_offsets
from nearfar.transport.model import Transport
from nearfar.transport.near import centre

# Offsets reach as far as light under a surface is told from what else is there.
REACH = 6
# Dense rows of a block take this many numbers.
BLOCK_NUMBERS = 1 << 25


def offsets() -> NDArray[np.int64]:
    """Return the offsets (y, x) from the rounded q, shape (O, 2)."""
    return window_offsets(2 * REACH + 1)


def on_projector(places: Integers, transport: Transport) -> Booleans:
    """Return whether places (..., 2) are projector pixels, shape (...)."""
    inside: Booleans = np.all((places >= 0) & (places < np.array(transport.projector)), axis=-1)
    return inside


def rows_about_q(transport: Transport, chosen: Booleans) -> Iterator[tuple[Integers, Floats]]:
    """Read rows about q, block by block.

    Parameters
    ----------
    transport : Transport
    chosen : ndarray of bool, shape (C,)
        Camera pixels with direct light.

    Yields
    ------
    pixels : ndarray of int, shape (n,)
        The chosen camera pixels of a block.
    entries : ndarray, shape (n, channels, O), float32
        Their rows at `offsets`; 0 beyond the projector's border.
    """
    projector = transport.projector
    centres = centre(transport.correspondence, projector)
    steps = offsets()
    length = BLOCK_NUMBERS // (transport.channels * projector.pixels)
    for block in blocks(len(chosen), length):
        pixels = block.start + np.flatnonzero(chosen[block])
        if not len(pixels):
            continue
        rows = transport.rows(slice(int(pixels[0]), int(pixels[-1]) + 1))[pixels - pixels[0]]
        places = centres[pixels, None] + steps
        inside = on_projector(places, transport)
        flat = np.where(inside, places[..., 0] * projector.width + places[..., 1], 0)
        entries = np.take_along_axis(rows, flat[:, None], axis=2)
        yield pixels, entries * inside[:, None]
