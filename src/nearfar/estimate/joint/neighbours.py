"""The expectation of a camera pixel's n and f from its 3 x 3 neighbourhood.

Near- and far-range light, as shares of white, change slowly over a surface. Where neighbours differ
by no more than their noise, their mean is expected. Where they differ by more, the expectation is
closer to the camera pixel's own value, so that edges are kept (the local linear minimum mean square
error filter; Lee, IEEE PAMI 2, 1980). Where they differ in the highest frequencies, they hardly
have a say at all.

Index convention: arrays are (Cy, Cx, channels, j), j over coefficients.
"""

import math

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, beside, namespace
from nearfar.parallel import in_batches

# Standard deviation, as a share of white, below which noise counts as this much.
DEVIATION_FLOOR = 1e-6
# Keeps divisions defined where no neighbour has any weight.
DIVISOR_FLOOR = 1e-30
# Neighbours on one surface agree in the highest frequencies. Where they do not, their rows have
# nothing in common, and every coefficient is taken to differ by this many times as much: estimates
# are shrunk, so that their scatter is too small. With 4, random light on dense transports gains 0.6
# dB; with 8, that on lamps loses 1.5 dB.
HIGHEST_FACTOR = 4.0
# Bytes of coefficients filtered at once.
BYTES_AT_ONCE = 2**22


def expect_each(
    values: Floats, white: Floats, variance: Floats, multiplicity: Floats, highest: Integers
) -> tuple[Floats, Floats]:
    """Filter each coefficient with a gain of its own.

    Parameters
    ----------
    values : ndarray, shape (Cy, Cx, channels, J)
        Photo units.
    white : ndarray, shape (Cy, Cx, channels)
        Light under white, as shares of which coefficients are filtered.
    variance : ndarray, shape (Cy, Cx, channels)
        Of the shares' noise if measured once; above 0.
    multiplicity : ndarray, shape (J,)
        How often each was measured.
    highest : ndarray of int
        Coefficients of the highest frequencies.

    Returns
    -------
    expected : ndarray, shape (Cy, Cx, channels, J)
    noise_left : ndarray, shape (Cy, Cx, channels)
        Variance that noise has in what is expected, as a share of that which it has in a camera
        pixel's own values; the mean over j.
    """
    xp = namespace(values)
    found: Floats = xp.empty_like(values)
    noise_left: Floats = xp.empty_like(white)
    precision = xp.astype(1.0 / variance[..., None], values.dtype)
    # Scatter that noise alone has, relative to its variance, and two standard deviations of the
    # mean of that of nine values.
    by_noise = 1.0 + 1.0 / math.sqrt(len(highest))

    def work(rows: slice) -> None:
        some = _with_neighbours(values, rows) / _with_neighbours(white[..., None], rows)
        weight = _with_neighbours(precision, rows)
        total = _sum(weight)
        mean, scatter = _mean_and_scatter(some, weight, total)
        noise = variance[rows, ..., None] / multiplicity
        change = scatter - 1.0 / (total * multiplicity)
        relative = scatter[..., highest] / noise[..., highest]
        common = xp.mean(relative, axis=-1, keepdims=True) - by_noise
        change = xp.clip(xp.maximum(change, HIGHEST_FACTOR * common * noise), min=0.0)
        gain = change / (change + noise)
        found[rows] = (mean + gain * (some[1:-1, 1:-1] - mean)) * white[rows, ..., None]
        gains = xp.mean(gain, axis=-1), xp.mean(gain**2, axis=-1)
        noise_left[rows] = _noise_left(weight[..., 0], total[..., 0], rows, len(values), gains)

    in_batches(work, len(values), rows_at_once(values), values)
    return found, noise_left


def expect_together(values: Floats, white: Floats, variance: Floats, lit: Booleans) -> Floats:
    """Filter coefficients with one gain for all of them.

    Parameters
    ----------
    values : ndarray, shape (Cy, Cx, channels, J)
        Photo units.
    white : ndarray, shape (Cy, Cx, channels)
        Light under white, as shares of which coefficients are filtered.
    variance : ndarray, shape (Cy, Cx, channels)
        Of the shares' noise, the mean over j.
    lit : ndarray of bool, shape (Cy, Cx)
        Camera pixels that are averaged; at the rest 0 is expected.

    Returns
    -------
    ndarray, shape (Cy, Cx, channels, J)
    """
    xp = namespace(values)
    found: Floats = xp.empty_like(values)
    weights = lit[..., None] / xp.clip(variance, min=DEVIATION_FLOOR**2)
    precision = xp.astype(weights[..., None], values.dtype)

    def work(rows: slice) -> None:
        some = _with_neighbours(values, rows) / _with_neighbours(white[..., None], rows)
        weight = _with_neighbours(precision, rows)
        total = xp.clip(_sum(weight), min=DIVISOR_FLOOR)
        mean, scatter = _mean_and_scatter(some, weight, total)
        change = xp.clip(xp.mean(scatter, axis=-1, keepdims=True) - 1.0 / total, min=0.0)
        gain = change / xp.clip(change + variance[rows, ..., None], min=DIVISOR_FLOOR)
        expected = (mean + gain * (some[1:-1, 1:-1] - mean)) * white[rows, ..., None]
        found[rows] = xp.where(lit[rows, :, None, None], expected, 0.0)

    in_batches(work, len(values), rows_at_once(values), values)
    return found


def rows_at_once(values: Floats) -> int:
    """Return how many camera rows of values (Cy, Cx, ...) are filtered at once, at least 1."""
    row = math.prod(values.shape[1:]) * 4
    return max(1, BYTES_AT_ONCE // max(1, row))


def _with_neighbours(values: Floats, rows: slice) -> Floats:
    """Return rows with one more pixel on every side, repeated at the camera's border."""
    some = values[max(rows.start - 1, 0) : rows.stop + 1]
    above = [some[:1]] if rows.start == 0 else []
    below = [some[-1:]] if rows.stop == len(values) else []
    xp = namespace(values)
    tall = xp.concat([*above, some, *below], axis=0)
    wide: Floats = xp.concat([tall[:, :1], tall, tall[:, -1:]], axis=1)
    return wide


def _noise_left(
    weight: Floats, total: Floats, rows: slice, height: int, gains: tuple[Floats, Floats]
) -> Floats:
    """Return the variance of noise in what is expected over that in a camera pixel's own values.

    Parameters
    ----------
    weight : ndarray, shape (n + 2, Cx + 2, channels)
        Of rows and those beside them: 1 / variance.
    total : ndarray, shape (n, Cx, channels)
        Its sum over each neighbourhood.
    rows : slice
    height : int
        Rows of the camera.
    gains : tuple of ndarray, shape (n, Cx, channels)
        Mean gain of a camera pixel's difference from the mean, and mean of its square.
    """
    xp = namespace(weight)
    down, across = _copies(height)[rows], _copies(weight.shape[1] - 2)
    count, width = down.shape[0], across.shape[0]
    down, across = (beside(copies.astype(np.float32), weight) for copies in (down, across))
    # Each camera pixel as often as the mean holds it.
    held = sum(down[:, i, None, None] * weight[i : count + i] for i in range(3))
    held = sum(across[:, i, None] * held[:, i : width + i] for i in range(3))
    gain, square = gains
    own = weight[1:-1, 1:-1] / total
    of_own = down[:, 1, None, None] * across[:, 1, None] * own
    left: Floats = xp.clip(
        square + 2 * (gain - square) * of_own + (1 - 2 * gain + square) * own * held / total,
        max=1.0,
    )
    return left


def _copies(length: int) -> Integers:
    """Return how often the mean over three pixels in a line holds each of them, (length, 3)."""
    held = np.clip(np.arange(length)[:, None] + np.arange(-1, 2), 0, length - 1)
    return np.asarray((held[:, :, None] == held[:, None, :]).sum(axis=-1))


def _sum(values: Floats) -> Floats:
    """Return the sum over the 3 x 3 neighbourhood of all but the outermost pixels."""
    down = values[:-2] + values[1:-1]
    down += values[2:]
    across = down[:, :-2] + down[:, 1:-1]
    across += down[:, 2:]
    return across


def _mean_and_scatter(values: Floats, weight: Floats, total: Floats) -> tuple[Floats, Floats]:
    """Return the weighted mean and variance over the neighbourhood."""
    weighted = weight * values
    mean = _sum(weighted) / total
    weighted *= values
    return mean, _sum(weighted) / total - mean**2
