"""Near- and far-range light about q, on a grid of offsets.

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
# Camera pixels of a block.
BLOCK_PIXELS = 4096


def offsets() -> NDArray[np.int64]:
    """Return the offsets (y, x) from the rounded q in steps, shape (O, 2)."""
    return window_offsets(2 * REACH + 1)


def rows_about_q(
    transport: Transport, chosen: Booleans, step: int
) -> Iterator[tuple[Integers, Floats]]:
    """Read near- and far-range light about q, block by block.

    Parameters
    ----------
    transport : Transport
    chosen : ndarray of bool, shape (C,)
        Camera pixels with direct light.
    step : int
        Projector pixels between offsets.

    Yields
    ------
    pixels : ndarray of int, shape (n,)
        The chosen camera pixels of a block.
    entries : ndarray, shape (n, channels, O), float32
        Light of step x step projector pixels at `offsets`; 0 beyond the projector's border.
    """
    projector, factors = transport.projector, transport.factors
    centres = centre(transport.correspondence, projector)
    steps = step * offsets()
    functions = transport.near_basis.values_at(steps).T.astype(np.float32)
    basis = factors.far_basis
    waves = basis.weights[:, None] * basis.patterns_at(steps)
    every = np.flatnonzero(chosen)
    for block in blocks(len(every), BLOCK_PIXELS):
        pixels = every[block]
        far = basis.recentre(factors.far[pixels], centres[pixels])
        entries = factors.near[pixels] @ functions + far @ waves.astype(np.float32)
        places = centres[pixels, None] + steps
        inside: Booleans = np.all((places >= 0) & (places < np.array(projector)), axis=-1)
        yield pixels, step**2 * entries * inside[:, None]
