"""Near- and far-range light about q, on a grid of offsets.

Index convention: c runs over chosen camera pixels, o over a square of (2 REACH + 1)^2 offsets from
the rounded q, row by row.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Integers, blocks
from nearfar.estimate.physical.cells import cell_side
from nearfar.illumination.near_basis import window_offsets
from nearfar.parallel import side_by_side
from nearfar.transport.model import Transport
from nearfar.transport.near import centre

# Offsets reach as far as light under a surface is told from what else is there.
REACH = 6
# Distance of light that is next to q, in cells.
NEXT_TO_Q = 2.3
# Camera pixels of a block.
BLOCK_PIXELS = 4096


def offsets() -> NDArray[np.int64]:
    """Return the offsets (y, x) from the rounded q in steps, shape (O, 2)."""
    return window_offsets(2 * REACH + 1)


def of_rows_about_q(
    transport: Transport, chosen: Booleans, step: int, reduce: Callable[[Integers, Floats], Floats]
) -> Floats:
    """Apply a function to near- and far-range light about q, block by block, and join its results.

    Parameters
    ----------
    transport : Transport
    chosen : ndarray of bool, shape (C,)
        Camera pixels with direct light.
    step : int
        Projector pixels between offsets.
    reduce : callable
        Called with the chosen camera pixels of a block, (n,), and with their light of step x step
        projector pixels at `offsets`, (n, channels, O), float32, 0 beyond the projector's border;
        returns an array (n, ...). Several blocks are worked at side by side.

    Returns
    -------
    ndarray, shape (number of chosen camera pixels, ...)
    """
    projector, factors = transport.projector, transport.factors
    centres = centre(transport.correspondence, projector)
    steps = step * offsets()
    functions = transport.near_basis.values_at(steps).T.astype(np.float32)
    basis = factors.far_basis
    waves = (basis.weights[:, None] * basis.patterns_at(steps)).astype(np.float32)
    every = np.flatnonzero(chosen)
    parts = list(blocks(len(every), BLOCK_PIXELS)) or [slice(0, 0)]
    found: dict[int, Floats] = {}

    def work(block: slice) -> None:
        pixels = every[block]
        far = basis.recentre(factors.far[pixels], centres[pixels])
        entries = factors.near[pixels] @ functions + far @ waves
        places = centres[pixels, None] + steps
        inside: Booleans = np.all((places >= 0) & (places < np.array(projector)), axis=-1)
        found[block.start] = reduce(pixels, step**2 * entries * inside[:, None])

    side_by_side(work, parts)
    return np.concatenate([found[block.start] for block in parts])


def light_next_to_q(transport: Transport, chosen: Booleans) -> Floats:
    """Return near- and far-range light next to q under white, shape (Cy, Cx, channels).

    Parameters
    ----------
    transport : Transport
    chosen : ndarray of bool, shape (Cy, Cx)
        Camera pixels with direct light.

    Returns
    -------
    ndarray
        NaN at others, and where the projector's border cuts it off.
    """
    step = cell_side(transport)
    near: Booleans = np.hypot(*offsets().T) <= NEXT_TO_Q
    margin = step * NEXT_TO_Q
    last = np.array(transport.projector) - 1 - margin
    q = transport.correspondence
    whole = chosen & np.all((q >= margin) & (q <= last), axis=-1)
    found = np.full((transport.camera.pixels, transport.channels), np.nan)
    found[whole.ravel()] = of_rows_about_q(
        transport,
        whole.ravel(),
        step,
        lambda _pixels, entries: np.asarray(entries[..., near].sum(axis=-1)),
    )
    return found.reshape(transport.direct.shape)
