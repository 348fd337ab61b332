"""Searching for q and a footprint's four numbers, in compiled loops over camera pixels.

A step changes the footprint along one axis of the projector, so that waves along the other are
kept.

Index convention: r runs over real responses; n over camera pixels.
"""

import numpy as np

from nearfar.arrays import Floats
from nearfar.compiled import compiled
from nearfar.estimate.joint.box_waves import mean_wave
from nearfar.transport.boxes import LEAST_WIDTH


@compiled
def _waves_along(numbers: Floats, axis: int, waves: Floats, sums: Floats, found: Floats) -> None:
    """Write the mean waves of both boxes of a footprint along an axis, (2, 2, R)."""
    side, skew = max(numbers[2 + axis], LEAST_WIDTH), numbers[4 + axis]
    mean_wave(numbers[axis] - skew, side, waves[axis], sums[axis], found[0])
    if skew == 0.0:
        for part in range(2):
            for r in range(found.shape[2]):
                found[1, part, r] = found[0, part, r]
    else:
        mean_wave(numbers[axis] + skew, side, waves[axis], sums[axis], found[1])


@compiled
def _power(responses: Floats, roots: Floats, down: Floats, across: Floats, slanted: bool) -> float:
    """Return how much of the power of responses (channels, R) both boxes explain."""
    squared, total = np.float32(0.0), 0.0
    one_down, other_down = down[0], down[1]
    one_across, other_across = across[0], across[1]
    along = np.zeros(len(responses), dtype=np.float32)
    share = np.float32(0.5 if slanted else 1.0)
    for r in range(len(roots)):
        direct = one_down[0, r] * one_across[0, r] + one_down[1, r] * one_across[1, r]
        if slanted:
            direct += other_down[0, r] * other_across[0, r] + other_down[1, r] * other_across[1, r]
        direct *= share * roots[r]
        squared += direct * direct
        for channel in range(len(responses)):
            along[channel] += responses[channel, r] * direct
    for channel in range(len(responses)):
        total += np.float64(max(along[channel], np.float32(0.0))) ** 2
    return float(total / max(squared, np.float32(1e-12)))


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
    down = np.empty((2, 2, count), dtype=np.float32)
    across = np.empty_like(down)
    tried = np.empty(6)
    for n in range(len(numbers)):
        height, width = numbers[n, 2], numbers[n, 3]
        for shape in range(len(shapes)):
            for i in range(6):
                value = numbers[n, i]
                if i >= 2:
                    value = shapes[shape, i - 2] * (height if i % 2 == 0 else width)
                tried[i] = min(max(value, lowest[n, i]), highest[n, i])
            _waves_along(tried, 0, waves, sums, down)
            _waves_along(tried, 1, waves, sums, across)
            slanted = tried[4] != 0.0 or tried[5] != 0.0
            explained = _power(responses[n], roots, down, across, slanted)
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
    held = np.empty((2, 2, 2, count), dtype=np.float32)
    found = np.empty((2, 2, count), dtype=np.float32)
    tried = np.empty(6)
    for n in range(len(numbers)):
        mine = numbers[n]
        _waves_along(mine, 0, waves, sums, held[0])
        _waves_along(mine, 1, waves, sums, held[1])
        for s in range(len(steps)):
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
                _waves_along(tried, axis, waves, sums, found)
                down = found if axis == 0 else held[0]
                across = found if axis == 1 else held[1]
                slanted = tried[4] != 0.0 or tried[5] != 0.0
                explained = _power(responses[n], roots, down, across, slanted)
                if explained > best[n]:
                    best[n], mine[i] = explained, tried[i]
                    for box in range(2):
                        for part in range(2):
                            for r in range(count):
                                held[axis, box, part, r] = found[box, part, r]
