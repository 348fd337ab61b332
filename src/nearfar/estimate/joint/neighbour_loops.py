"""What `neighbours` expects, in compiled loops: one pass over each camera pixel's neighbourhood.

Index convention: arrays are (Cy, Cx, channels, j), j over coefficients.
"""

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, blocks
from nearfar.compiled import compiled
from nearfar.estimate.joint.chessboard import Part
from nearfar.estimate.joint.neighbours import DEVIATION_FLOOR, DIVISOR_FLOOR, HIGHEST_FACTOR
from nearfar.parallel import side_by_side

# Camera pixels on which one thread works.
PIXELS = 4096


def expect_each_by_pixel(
    values: Floats,
    white: Floats,
    variance: Floats,
    multiplicity: Floats,
    highest: Integers,
    part: Part,
) -> Floats:
    """Filter each coefficient with a gain of its own; see `neighbours.expect_each`.

    Returns
    -------
    ndarray, shape (n, channels, J)
        Of the part's camera pixels. Where one is not known itself, the mean of its neighbours is
        expected.
    """
    selected, known = part
    found = np.empty((len(selected), *values.shape[2:]), dtype=values.dtype)
    weight = (known[..., None] / variance).astype(values.dtype)
    by_noise = 1.0 + 1.0 / np.sqrt(len(highest))

    def work(some: slice) -> None:
        _expect_each(
            values,
            white,
            variance,
            weight,
            multiplicity,
            highest,
            by_noise,
            selected[some],
            found[some],
        )

    side_by_side(work, blocks(len(selected), PIXELS))
    return found


def expect_together_by_pixel(
    values: Floats, white: Floats, variance: Floats, lit: Booleans, part: Part
) -> Floats:
    """Filter coefficients with one gain for all of them; see `neighbours.expect_together`.

    Returns
    -------
    ndarray, shape (n, channels, J)
        Of the part's camera pixels. Where one is not known itself, the mean of its neighbours is
        expected.
    """
    selected, known = part
    found = np.empty((len(selected), *values.shape[2:]), dtype=values.dtype)
    has_say = (lit & known)[..., None]
    weight = (has_say / np.maximum(variance, DEVIATION_FLOOR**2)).astype(values.dtype)

    def work(some: slice) -> None:
        _expect_together(values, white, variance, weight, lit, selected[some], found[some])

    side_by_side(work, blocks(len(selected), PIXELS))
    return found


@compiled
def _moments(
    values: Floats,
    white: Floats,
    weight: Floats,
    place: tuple[int, int, int],
    mean: Floats,
    scatter: Floats,
) -> float:
    """Write the weighted mean and variance of a neighbourhood's shares of white; return its weight.

    Pixels at the camera's border are repeated beyond it.
    """
    y, x, channel = place
    last_y, last_x = values.shape[0] - 1, values.shape[1] - 1
    mean[:] = 0.0
    scatter[:] = 0.0
    total = 0.0
    for down in range(-1, 2):
        for across in range(-1, 2):
            row, column = min(max(y + down, 0), last_y), min(max(x + across, 0), last_x)
            its = weight[row, column, channel]
            if not its > 0.0:
                continue
            some = values[row, column, channel]
            scale = mean.dtype.type(1.0 / white[row, column, channel])
            total += its
            for j in range(len(mean)):
                share = some[j] * scale
                weighted = its * share
                mean[j] += weighted
                scatter[j] += weighted * share
    total = max(total, DIVISOR_FLOOR)
    by_total = mean.dtype.type(1.0 / total)
    for j in range(len(mean)):
        mean[j] *= by_total
        scatter[j] = scatter[j] * by_total - mean[j] * mean[j]
    return total


@compiled
def _expect_each(
    values: Floats,
    white: Floats,
    variance: Floats,
    weight: Floats,
    multiplicity: Floats,
    highest: Integers,
    by_noise: float,
    selected: Integers,
    found: Floats,
) -> None:
    mean, scatter = np.empty((2, values.shape[3]), dtype=values.dtype)
    for n in range(len(selected)):
        y, x = divmod(selected[n], values.shape[1])
        for c in range(values.shape[2]):
            total = _moments(values, white, weight, (y, x, c), mean, scatter)
            common = 0.0
            for j in highest:
                common += scatter[j] * multiplicity[j]
            common = common / (variance[y, x, c] * len(highest)) - by_noise
            least = mean.dtype.type(HIGHEST_FACTOR * max(common, 0.0) * variance[y, x, c])
            noise, of_mean = mean.dtype.type(variance[y, x, c]), mean.dtype.type(1.0 / total)
            scale = mean.dtype.type(white[y, x, c])
            own, expected = values[y, x, c], found[n, c]
            has_say = mean.dtype.type(1.0 if weight[y, x, c] > 0.0 else 0.0)
            for j in range(len(mean)):
                # Both times how often the coefficient was measured.
                change = max(scatter[j] * multiplicity[j] - of_mean, least)
                gain = has_say * change / (change + noise)
                expected[j] = (mean[j] * scale) + gain * (own[j] - mean[j] * scale)


@compiled
def _expect_together(
    values: Floats,
    white: Floats,
    variance: Floats,
    weight: Floats,
    lit: Booleans,
    selected: Integers,
    found: Floats,
) -> None:
    mean, scatter = np.empty((2, values.shape[3]), dtype=values.dtype)
    for n in range(len(selected)):
        y, x = divmod(selected[n], values.shape[1])
        for c in range(values.shape[2]):
            own, expected = values[y, x, c], found[n, c]
            if not lit[y, x]:
                expected[:] = 0.0
                continue
            total = _moments(values, white, weight, (y, x, c), mean, scatter)
            change = 0.0
            for j in range(len(scatter)):
                change += scatter[j]
            change = max(change / len(scatter) - 1.0 / total, 0.0)
            gain = mean.dtype.type(change / max(change + variance[y, x, c], DIVISOR_FLOOR))
            if not weight[y, x, c] > 0.0:
                gain = mean.dtype.type(0.0)
            scale = mean.dtype.type(white[y, x, c])
            for j in range(len(mean)):
                expected[j] = (mean[j] * scale) + gain * (own[j] - mean[j] * scale)
