"""Searching for q and a footprint's four numbers, in compiled loops over camera pixels.

A step changes the footprint along one axis of the projector, so that waves along the other are
kept.

Index convention: r runs over real responses; n over camera pixels.
"""

import numpy as np

from nearfar.arrays import Floats
from nearfar.compiled import compiled
from nearfar.estimate.joint.box_waves import power_along, put_mean_waves
from nearfar.transport.boxes import LEAST_WIDTH


@compiled
def _put_both(
    numbers: Floats, axis: int, waves: Floats, sums: Floats, means: Floats, place: int
) -> None:
    """Write the mean waves of both boxes of a footprint along an axis to two places of means."""
    side, skew = max(numbers[2 + axis], LEAST_WIDTH), numbers[4 + axis]
    put_mean_waves(numbers[axis] - skew, side, axis, waves, sums, means, place)
    if skew == 0.0:
        for part in range(2):
            for r in range(means.shape[2]):
                means[place + 1, part, r] = means[place, part, r]
    else:
        put_mean_waves(numbers[axis] + skew, side, axis, waves, sums, means, place + 1)


@compiled
def _power(
    responses: Floats,
    n: int,
    roots: Floats,
    means: Floats,
    down: int,
    across: int,
    slanted: bool,
    direct: Floats,
) -> float:
    """Return how much of the power of responses[n], (channels, R), both boxes explain.

    Their mean waves are at the places `down` and `across`, and the next ones; `direct`, (R,), is
    overwritten.
    """
    share = np.float32(0.5 if slanted else 1.0)
    for r in range(len(roots)):
        one = means[down, 0, r] * means[across, 0, r] + means[down, 1, r] * means[across, 1, r]
        direct[r] = share * one
    if slanted:
        down, across = down + 1, across + 1
        for r in range(len(roots)):
            other = means[down, 0, r] * means[across, 0, r]
            direct[r] += share * (other + means[down, 1, r] * means[across, 1, r])
    return float(power_along(responses, n, roots, direct))


@compiled
def best_shapes(
    responses: Floats,
    roots: Floats,
    shapes: Floats,
    lowest: Floats,
    highest: Floats,
    waves: Floats,
    sums: Floats,
    numbers: Floats,
    best: Floats,
) -> None:
    """Replace footprints by the best of shapes, where it explains more; parameters as in `descend`.

    `shapes`, (S, 4), are in units of the footprints' sides.
    """
    count = len(roots)
    means, direct = np.empty((4, 2, count), np.float32), np.empty(count, np.float32)
    tried = np.empty(6)
    for n in range(len(numbers)):
        height, width = numbers[n, 2], numbers[n, 3]
        for shape in range(len(shapes)):
            for i in range(6):
                value = numbers[n, i]
                if i >= 2:
                    value = shapes[shape, i - 2] * (height if i % 2 == 0 else width)
                tried[i] = min(max(value, lowest[n, i]), highest[n, i])
            _put_both(tried, 0, waves, sums, means, 0)
            _put_both(tried, 1, waves, sums, means, 2)
            slanted = tried[4] != 0.0 or tried[5] != 0.0
            explained = _power(responses, n, roots, means, 0, 2, slanted, direct)
            if explained > best[n]:
                best[n] = explained
                for i in range(6):
                    numbers[n, i] = tried[i]


@compiled
def descend(
    responses: Floats,
    roots: Floats,
    steps: Floats,
    coordinates: int,
    lowest: Floats,
    highest: Floats,
    waves: Floats,
    sums: Floats,
    numbers: Floats,
    best: Floats,
) -> None:
    """Replace footprints by those that falling steps along each of their numbers lead to.

    Parameters
    ----------
    responses : ndarray, shape (n, channels, R), float32
        In units of their noise.
    roots : ndarray, shape (R,), float32
        One measurement's noise in units of each response's.
    steps : ndarray, shape (S,)
        As shares of the mean of the box's sides and a projector pixel.
    coordinates : int
        2 to move q alone, 6 to change the footprint as well.
    lowest, highest : ndarray, shape (n, 6)
        Bounds of the numbers.
    waves, sums : ndarray
        As `WaveTable` has them.
    numbers : ndarray, shape (n, 6), float64
        q from the rounded q, and the footprint; overwritten.
    best : ndarray, shape (n,), float64
        What they explain; overwritten.
    """
    count = len(roots)
    # Two places for each axis, and two for what is tried.
    means, direct = np.empty((6, 2, count), np.float32), np.empty(count, np.float32)
    mine, tried, held = np.empty(6), np.empty(6), np.empty(2, np.int64)
    for n in range(len(numbers)):
        for j in range(6):
            mine[j] = numbers[n, j]
        held[0], held[1], free = 0, 2, 4
        _put_both(mine, 0, waves, sums, means, 0)
        _put_both(mine, 1, waves, sums, means, 2)
        has_moved = True
        for s in range(len(steps)):
            # A step that has led nowhere leads nowhere again.
            if s > 0 and steps[s] == steps[s - 1] and not has_moved:
                continue
            has_moved = False
            for way in range(2 * coordinates):
                i = way % coordinates
                sign = 1.0 if way < coordinates else -1.0
                size = 0.5 * (1.0 + 0.5 * (mine[2] + mine[3]))
                for j in range(6):
                    tried[j] = mine[j]
                moved = mine[i] + sign * steps[s] * size
                tried[i] = min(max(moved, lowest[n, i]), highest[n, i])
                if tried[i] == mine[i]:
                    continue
                axis = i % 2
                _put_both(tried, axis, waves, sums, means, free)
                down = free if axis == 0 else held[0]
                across = free if axis == 1 else held[1]
                slanted = tried[4] != 0.0 or tried[5] != 0.0
                explained = _power(responses, n, roots, means, down, across, slanted, direct)
                if explained > best[n]:
                    best[n], mine[i], has_moved = explained, tried[i], True
                    held[axis], free = free, held[axis]
        for j in range(6):
            numbers[n, j] = mine[j]
