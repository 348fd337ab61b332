"""What `neighbours` expects, in compiled loops: one pass over each camera pixel's neighbourhood.

Index convention: arrays are (Cy, Cx, channels, j), j over coefficients.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers
from nearfar.compiled import compiled
from nearfar.estimate.joint.neighbours import DEVIATION_FLOOR, DIVISOR_FLOOR, HIGHEST_FACTOR

# Writes what is expected of camera pixels (n,), their indices, to (n, channels, J).
Expectation = Callable[[Integers, Floats], None]


def expect_each_by_pixel(
    values: Floats,
    white: Floats,
    variance: Floats,
    multiplicity: Floats,
    highest: Integers,
    known: Booleans,
) -> Expectation:
    """Return a filter of each coefficient with a gain of its own; see `neighbours.expect_each`.

    Where a camera pixel is not known itself, the mean of its neighbours is expected.
    """
    weight = (known[..., None] / variance).astype(values.dtype)
    by_noise = 1.0 + 1.0 / np.sqrt(len(highest))
    of_highest = np.zeros(values.shape[3], dtype=values.dtype)
    of_highest[highest] = multiplicity[highest] / len(highest)
    return partial(
        _expect_each, values, white, variance, weight, multiplicity, of_highest, by_noise
    )


def expect_together_by_pixel(
    values: Floats, white: Floats, variance: Floats, lit: Booleans, known: Booleans
) -> Expectation:
    """Return a filter of coefficients with one gain for all; see `neighbours.expect_together`.

    Where a camera pixel is not known itself, the mean of its neighbours is expected.
    """
    has_say = (lit & known)[..., None]
    weight = (has_say / np.maximum(variance, DEVIATION_FLOOR**2)).astype(values.dtype)
    return partial(_expect_together, values, white, variance, weight, lit)


# Loops read whole arrays by index: a slice of an array takes longer to make than a row to add up.
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
    total, zero = 0.0, mean.dtype.type(0.0)
    for j in range(len(mean)):
        mean[j] = zero
        scatter[j] = zero
    for down in range(-1, 2):
        row = min(max(y + down, 0), last_y)
        # Three of a row at once, so that sums are read and written less often.
        left, right = max(x - 1, 0), min(x + 1, last_x)
        of_left, of_middle, of_right = (
            weight[row, left, channel],
            weight[row, x, channel],
            weight[row, right, channel],
        )
        total += of_left + of_middle + of_right
        by_left = mean.dtype.type(1.0 / white[row, left, channel])
        by_middle = mean.dtype.type(1.0 / white[row, x, channel])
        by_right = mean.dtype.type(1.0 / white[row, right, channel])
        if of_left == 0.0 and of_right == 0.0:
            if of_middle == 0.0:
                continue
            for j in range(len(mean)):
                share = values[row, x, channel, j] * by_middle
                mean[j] += of_middle * share
                scatter[j] += of_middle * share * share
        else:
            for j in range(len(mean)):
                one = values[row, left, channel, j] * by_left
                two = values[row, x, channel, j] * by_middle
                three = values[row, right, channel, j] * by_right
                mean[j] += of_left * one + of_middle * two + of_right * three
                scatter[j] += of_left * one * one + of_middle * two * two + of_right * three * three
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
    of_highest: Floats,
    by_noise: float,
    selected: Integers,
    found: Floats,
) -> None:
    mean, scatter = np.empty(values.shape[3], values.dtype), np.empty(values.shape[3], values.dtype)
    for n in range(len(selected)):
        y, x = divmod(selected[n], values.shape[1])
        for c in range(values.shape[2]):
            total = _moments(values, white, weight, (y, x, c), mean, scatter)
            common = mean.dtype.type(0.0)
            for j in range(len(mean)):
                common += scatter[j] * of_highest[j]
            excess = common / variance[y, x, c] - by_noise
            least = mean.dtype.type(HIGHEST_FACTOR * max(excess, 0.0) * variance[y, x, c])
            noise, of_mean = mean.dtype.type(variance[y, x, c]), mean.dtype.type(1.0 / total)
            scale = mean.dtype.type(white[y, x, c])
            has_say = mean.dtype.type(1.0 if weight[y, x, c] > 0.0 else 0.0)
            for j in range(len(mean)):
                # Both times how often the coefficient was measured.
                change = max(scatter[j] * multiplicity[j] - of_mean, least)
                gain = has_say * change / (change + noise)
                expected = mean[j] * scale
                found[n, c, j] = expected + gain * (values[y, x, c, j] - expected)


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
    mean, scatter = np.empty(values.shape[3], values.dtype), np.empty(values.shape[3], values.dtype)
    for n in range(len(selected)):
        y, x = divmod(selected[n], values.shape[1])
        for c in range(values.shape[2]):
            if not lit[y, x]:
                for j in range(len(mean)):
                    found[n, c, j] = 0.0
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
                expected = mean[j] * scale
                found[n, c, j] = expected + gain * (values[y, x, c, j] - expected)
