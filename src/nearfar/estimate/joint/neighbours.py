"""What the neighbours of a camera pixel expect of it.

Near- and far-range light changes slowly over a surface. The mean over the neighbours, as a share
of white, is what a camera pixel is expected to show; it is trusted as far as the neighbours
differ by no more than their noise (the local linear minimum mean square error filter; Lee, IEEE
PAMI 2, 1980), so that edges stay.

Index convention: arrays are (Cy, Cx, channels, j), j over coefficients.
"""

import math

from nearfar.arrays import Booleans, Floats, blocks, namespace
from nearfar.parallel import side_by_side

# Light is never known better than to this share of white.
EXACT = 1e-6
TINY = 1e-30
# Bytes of coefficients filtered at once.
HELD = 2**22


def expect_each(values: Floats, variance: Floats, multiplicity: Floats) -> Floats:
    """Expect each coefficient by itself.

    Parameters
    ----------
    values : ndarray, shape (Cy, Cx, channels, J)
        As shares of white.
    variance : ndarray, shape (Cy, Cx, channels)
        Of their noise where they were measured once, above 0.
    multiplicity : ndarray, shape (J,)
        How often each was measured.
    """
    xp = namespace(values)
    found: Floats = xp.empty_like(values)
    whole = xp.astype(1.0 / variance[..., None], values.dtype)

    def work(rows: slice) -> None:
        some, weight, core = _with_neighbours(values, rows), _with_neighbours(whole, rows), rows
        total = _sum(weight)
        mean, scatter = _mean_and_scatter(some, weight, total)
        change = xp.clip(scatter - 1.0 / (total * multiplicity), min=0.0)
        trust = change / (change + variance[core, ..., None] / multiplicity)
        found[core] = mean + trust * (values[core] - mean)

    side_by_side(work, _row_blocks(values))
    return found


def expect_together(values: Floats, variance: Floats, known: Booleans) -> Floats:
    """Expect coefficients that belong together: one trust for all of them.

    Parameters
    ----------
    values : ndarray, shape (Cy, Cx, channels, J)
        As shares of white.
    variance : ndarray, shape (Cy, Cx, channels)
        Mean over j of that of their noise.
    known : ndarray of bool, shape (Cy, Cx)
        Camera pixels that have a say; the rest expect nothing.
    """
    xp = namespace(values)
    found: Floats = xp.zeros_like(values)
    heard = known[..., None] / xp.clip(variance, min=EXACT**2)
    whole = xp.astype(heard[..., None], values.dtype)

    def work(rows: slice) -> None:
        some, weight = _with_neighbours(values, rows), _with_neighbours(whole, rows)
        total = xp.clip(_sum(weight), min=TINY)
        mean, scatter = _mean_and_scatter(some, weight, total)
        change = xp.clip(xp.mean(scatter, axis=-1, keepdims=True) - 1.0 / total, min=0.0)
        trust = change / xp.clip(change + variance[rows, ..., None], min=TINY)
        expected = mean + trust * (values[rows] - mean)
        found[rows] = xp.where(known[rows, :, None, None], expected, 0.0)

    side_by_side(work, _row_blocks(values))
    return found


def _row_blocks(values: Floats) -> list[slice]:
    row = math.prod(values.shape[1:]) * 4
    return list(blocks(len(values), HELD // max(1, row)))


def _with_neighbours(values: Floats, rows: slice) -> Floats:
    """Rows and one more on every side; at the camera's border the last is repeated."""
    some = values[max(rows.start - 1, 0) : rows.stop + 1]
    above = [some[:1]] if rows.start == 0 else []
    below = [some[-1:]] if rows.stop == len(values) else []
    xp = namespace(values)
    tall = xp.concat([*above, some, *below], axis=0)
    wide: Floats = xp.concat([tall[:, :1], tall, tall[:, -1:]], axis=1)
    return wide


def _sum(values: Floats) -> Floats:
    """Sum over the 3 x 3 neighbourhood of all but the outermost."""
    down = values[:-2] + values[1:-1]
    down += values[2:]
    across = down[:, :-2] + down[:, 1:-1]
    across += down[:, 2:]
    return across


def _mean_and_scatter(values: Floats, weight: Floats, total: Floats) -> tuple[Floats, Floats]:
    """Weighted mean over the neighbourhood, and what the neighbours scatter about it."""
    weighed = weight * values
    mean = _sum(weighed) / total
    weighed *= values
    return mean, _sum(weighed) / total - mean**2
