"""Responses of direct light whose footprint is two boxes, re-centred on q.

Along an axis, the mean of a wave over a box is a weighted mean over the pixels that it covers:
those inside by a table of sums, and the two at its ends by their shares. A response is a product of
both axes' means.

Index convention: r runs over real responses; n over camera pixels.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats
from nearfar.compiled import compiled
from nearfar.illumination.centred_basis import CentredBasis
from nearfar.transport.boxes import LEAST_WIDTH

# Tables reach over a multiple of as many projector pixels, so that a few serve all batches.
REACH_MULTIPLE = 8


class WaveTable(NamedTuple):
    """Waves over the pixels about the rounded q, for each axis.

    The response r of a pixel is ``waves[0, 0, y, r] * waves[1, 0, x, r]`` plus the same of the
    second parts.

    Attributes
    ----------
    waves : ndarray, shape (2, 2, 2 reach + 1, R), float32
        Axis, part, pixel, response.
    sums : ndarray, shape (2, 2, 2 reach + 2, R), float32
        Of the waves from the rounded q's pixel on to before each pixel, whatever the reach.
    """

    waves: Floats
    sums: Floats


def wave_table(centred: CentredBasis, reach: int) -> WaveTable:
    """Return the waves over at least the pixels up to `reach` from the rounded q."""
    return _wave_table(centred, -(-reach // REACH_MULTIPLE) * REACH_MULTIPLE)


@lru_cache(maxsize=32)
def _wave_table(centred: CentredBasis, reach: int) -> WaveTable:
    pixels = np.arange(-reach, reach + 1)
    basis = centred.basis
    down, across = (
        np.exp(2j * np.pi * np.outer(pixels, basis.cycles[:, axis]))[:, basis.index]
        for axis in (0, 1)
    )
    # The real part of the product for cosines, the imaginary one for sines.
    parts = (
        [down.real, down.imag],
        [
            np.where(basis.is_sine, across.imag, across.real),
            np.where(basis.is_sine, across.real, -across.imag),
        ],
    )
    waves = np.array(parts)
    sums = np.pad(np.cumsum(waves, axis=2), ((0, 0), (0, 0), (1, 0), (0, 0)))
    sums -= sums[:, :, reach, None]
    return WaveTable(waves.astype(np.float32), sums.astype(np.float32))


@compiled
def mean_wave(middle: float, width: float, waves: Floats, sums: Floats, found: Floats) -> None:
    """Write the mean of both parts of waves (2, P, R) over a box along an axis to (2, R)."""
    reach = waves.shape[1] // 2
    low, high = middle - 0.5 * width, middle + 0.5 * width
    first = int(np.floor(low + 0.5)) + reach
    last = int(np.floor(high + 0.5)) + reach
    if first == last:
        for part in range(2):
            for r in range(found.shape[1]):
                found[part, r] = waves[part, first, r]
        return
    scale = 1.0 / width
    of_first = np.float32((first - reach + 0.5 - low) * scale)
    of_last = np.float32((high - (last - reach - 0.5)) * scale)
    inside = np.float32(scale)
    for part in range(2):
        for r in range(found.shape[1]):
            found[part, r] = (
                of_first * waves[part, first, r]
                + of_last * waves[part, last, r]
                + inside * (sums[part, last, r] - sums[part, first + 1, r])
            )


@compiled
def _of_boxes(middles: Floats, footprints: Floats, waves: Floats, sums: Floats) -> Floats:
    number, count = len(middles), waves.shape[3]
    found = np.empty((number, count), dtype=np.float32)
    down, across = np.empty((2, count), np.float32), np.empty((2, count), np.float32)
    half = np.float32(0.5)
    for n in range(number):
        height, width = max(footprints[n, 0], LEAST_WIDTH), max(footprints[n, 1], LEAST_WIDTH)
        skew_down, skew_across = footprints[n, 2], footprints[n, 3]
        mean_wave(middles[n, 0] - skew_down, height, waves[0], sums[0], down)
        mean_wave(middles[n, 1] - skew_across, width, waves[1], sums[1], across)
        for r in range(count):
            found[n, r] = down[0, r] * across[0, r] + down[1, r] * across[1, r]
        # Both boxes of an upright footprint are the same.
        if skew_down != 0.0 or skew_across != 0.0:
            mean_wave(middles[n, 0] + skew_down, height, waves[0], sums[0], down)
            mean_wave(middles[n, 1] + skew_across, width, waves[1], sums[1], across)
            for r in range(count):
                other = down[0, r] * across[0, r] + down[1, r] * across[1, r]
                found[n, r] = half * (found[n, r] + other)
    return found


@compiled
def _explained(
    responses: Floats,
    roots: Floats,
    middles: Floats,
    footprints: Floats,
    waves: Floats,
    sums: Floats,
) -> Floats:
    number, channels, count = responses.shape
    found = np.empty(number)
    down, across = np.empty((2, count), np.float32), np.empty((2, count), np.float32)
    direct, half = np.empty(count, np.float32), np.float32(0.5)
    for n in range(number):
        height, width = max(footprints[n, 0], LEAST_WIDTH), max(footprints[n, 1], LEAST_WIDTH)
        skew_down, skew_across = footprints[n, 2], footprints[n, 3]
        mean_wave(middles[n, 0] - skew_down, height, waves[0], sums[0], down)
        mean_wave(middles[n, 1] - skew_across, width, waves[1], sums[1], across)
        for r in range(count):
            direct[r] = down[0, r] * across[0, r] + down[1, r] * across[1, r]
        if skew_down != 0.0 or skew_across != 0.0:
            mean_wave(middles[n, 0] + skew_down, height, waves[0], sums[0], down)
            mean_wave(middles[n, 1] + skew_across, width, waves[1], sums[1], across)
            for r in range(count):
                other = down[0, r] * across[0, r] + down[1, r] * across[1, r]
                direct[r] = half * (direct[r] + other)
        squared = np.float32(0.0)
        for r in range(count):
            direct[r] *= roots[r]
            squared += direct[r] * direct[r]
        total = 0.0
        for channel in range(channels):
            along = np.float32(0.0)
            for r in range(count):
                along += responses[n, channel, r] * direct[r]
            total += np.float64(max(along, np.float32(0.0))) ** 2
        found[n] = total / max(squared, np.float32(1e-12))
    return found


@compiled
def _put_derivatives(
    middles: Floats,
    footprints: Floats,
    step: float,
    waves: Floats,
    sums: Floats,
    first: int,
    found: Floats,
) -> None:
    number, count = len(middles), waves.shape[3]
    at = np.empty((2, 2, count), dtype=np.float32)
    steep, before = np.empty_like(at), np.empty((2, count), dtype=np.float32)
    slope = np.float32(0.5 / step)
    for n in range(number):
        slanted = footprints[n, 2] != 0.0 or footprints[n, 3] != 0.0
        share = np.float32(0.5 if slanted else 1.0)
        whole, by_down, by_across = found[n, first], found[n, first + 1], found[n, first + 2]
        for r in range(count):
            whole[r], by_down[r], by_across[r] = 0.0, 0.0, 0.0
        for box in range(2 if slanted else 1):
            for axis in range(2):
                skew = footprints[n, 2 + axis] * (2.0 * box - 1.0)
                side = max(footprints[n, axis], LEAST_WIDTH)
                middle = middles[n, axis] + skew
                mean_wave(middle, side, waves[axis], sums[axis], at[axis])
                mean_wave(middle + step, side, waves[axis], sums[axis], steep[axis])
                mean_wave(middle - step, side, waves[axis], sums[axis], before)
                for part in range(2):
                    for r in range(count):
                        steep[axis, part, r] = (steep[axis, part, r] - before[part, r]) * slope
            for r in range(count):
                here = at[0, 0, r] * at[1, 0, r] + at[0, 1, r] * at[1, 1, r]
                down = steep[0, 0, r] * at[1, 0, r] + steep[0, 1, r] * at[1, 1, r]
                across = at[0, 0, r] * steep[1, 0, r] + at[0, 1, r] * steep[1, 1, r]
                whole[r] += share * here
                by_down[r] += share * down
                by_across[r] += share * across


def of_boxes(middles: Floats, footprints: Floats, table: WaveTable) -> Floats:
    """Return responses of unit direct light, (n, R), float32.

    Parameters
    ----------
    middles : ndarray, shape (n, 2)
        q from the rounded q.
    footprints : ndarray, shape (n, 4)
        As `nearfar.transport.boxes` describes them.
    table : WaveTable
        Over the pixels that they touch.
    """
    return _of_boxes(_as_doubles(middles), _as_doubles(footprints), table.waves, table.sums)


def explained_by_boxes(
    responses: Floats, roots: Floats, middles: Floats, footprints: Floats, table: WaveTable
) -> Floats:
    """Return how much of the power of responses direct light of footprints explains, (n,), float64.

    It is not negative.

    Parameters
    ----------
    responses : ndarray, shape (n, channels, R), float32
        Measured, in units of their noise.
    roots : ndarray, shape (R,), float32
        One measurement's noise in units of each response's.
    middles, footprints, table
        As in `of_boxes`.
    """
    both = _as_doubles(middles), _as_doubles(footprints)
    return np.asarray(_explained(responses, roots, *both, table.waves, table.sums))


def put_with_derivatives(
    middles: Floats, footprints: Floats, step: float, table: WaveTable, first: int, found: Floats
) -> None:
    """Write responses of unit direct light and their differences by q into an array (n, G, R).

    They take three of its second axis from `first` on. The differences are over `step` to both
    sides; other parameters as in `of_boxes`.
    """
    both = _as_doubles(middles), _as_doubles(footprints)
    _put_derivatives(*both, step, table.waves, table.sums, first, found)


def _as_doubles(values: Floats) -> Floats:
    return np.ascontiguousarray(values, dtype=np.float64)
