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


# Loops read whole arrays by index: a slice of an array takes longer to make than a row to add up.
@compiled
def ends_of_box(
    middle: float, width: float, reach: int
) -> tuple[int, int, np.float32, np.float32, np.float32]:
    """Return the pixels at both ends of a box along an axis, and the shares of its mean.

    The shares are those of both pixels, and of each pixel between them. A box within one pixel has
    that pixel's value.
    """
    low, high = middle - 0.5 * width, middle + 0.5 * width
    first = int(np.floor(low + 0.5)) + reach
    last = int(np.floor(high + 0.5)) + reach
    if first == last:
        return first, last, np.float32(1.0), np.float32(0.0), np.float32(0.0)
    scale = 1.0 / width
    of_first = np.float32((first - reach + 0.5 - low) * scale)
    of_last = np.float32((high - (last - reach - 0.5)) * scale)
    return first, last, of_first, of_last, np.float32(scale)


@compiled
def _mean_wave(
    ends: tuple[int, int, np.float32, np.float32, np.float32],
    axis: int,
    part: int,
    r: int,
    waves: Floats,
    sums: Floats,
) -> np.float32:
    """Return the mean of a part of one wave over a box with these ends."""
    first, last, of_first, of_last, inside = ends
    return np.float32(
        of_first * waves[axis, part, first, r]
        + of_last * waves[axis, part, last, r]
        + inside * (sums[axis, part, last, r] - sums[axis, part, first + 1, r])
    )


@compiled
def put_mean_waves(
    middle: float, width: float, axis: int, waves: Floats, sums: Floats, found: Floats, place: int
) -> None:
    """Write the mean of both parts of waves over a box along an axis to found[place], (2, R)."""
    ends = ends_of_box(middle, width, waves.shape[2] // 2)
    for r in range(found.shape[2]):
        found[place, 0, r] = _mean_wave(ends, axis, 0, r, waves, sums)
        found[place, 1, r] = _mean_wave(ends, axis, 1, r, waves, sums)


@compiled
def _put_direct(
    middle: tuple[float, float],
    sides: tuple[float, float],
    skew: tuple[float, float],
    waves: Floats,
    sums: Floats,
    found: Floats,
) -> None:
    """Write responses of one footprint to (R,)."""
    height, width = max(sides[0], LEAST_WIDTH), max(sides[1], LEAST_WIDTH)
    reach = waves.shape[2] // 2
    # Both boxes of an upright footprint are the same.
    slanted = skew[0] != 0.0 or skew[1] != 0.0
    share = np.float32(0.5 if slanted else 1.0)
    for r in range(len(found)):
        found[r] = 0.0
    for box in range(2 if slanted else 1):
        sign = 2.0 * box - 1.0
        down = ends_of_box(middle[0] + sign * skew[0], height, reach)
        across = ends_of_box(middle[1] + sign * skew[1], width, reach)
        for r in range(len(found)):
            y_cosine = _mean_wave(down, 0, 0, r, waves, sums)
            y_sine = _mean_wave(down, 0, 1, r, waves, sums)
            x_cosine = _mean_wave(across, 1, 0, r, waves, sums)
            x_sine = _mean_wave(across, 1, 1, r, waves, sums)
            found[r] += share * (y_cosine * x_cosine + y_sine * x_sine)


@compiled
def _of_boxes(middles: Floats, footprints: Floats, waves: Floats, sums: Floats) -> Floats:
    number, count = len(middles), waves.shape[3]
    found = np.empty((number, count), dtype=np.float32)
    direct = np.empty(count, dtype=np.float32)
    for n in range(number):
        middle, sides = (middles[n, 0], middles[n, 1]), (footprints[n, 0], footprints[n, 1])
        skew = (footprints[n, 2], footprints[n, 3])
        _put_direct(middle, sides, skew, waves, sums, direct)
        for r in range(count):
            found[n, r] = direct[r]
    return found


@compiled
def power_along(responses: Floats, n: int, roots: Floats, direct: Floats) -> float:
    """Return how much of the power of responses[n], (channels, R), direct light explains.

    Its responses, (R,), are overwritten.
    """
    squared, total = np.float32(0.0), 0.0
    for r in range(len(roots)):
        direct[r] *= roots[r]
        squared += direct[r] * direct[r]
    for channel in range(responses.shape[1]):
        along = np.float32(0.0)
        for r in range(len(roots)):
            along += responses[n, channel, r] * direct[r]
        total += np.float64(max(along, np.float32(0.0))) ** 2
    return float(total / max(squared, np.float32(1e-12)))


@compiled
def _explained(
    responses: Floats,
    roots: Floats,
    middles: Floats,
    footprints: Floats,
    blurs: Floats,
    waves: Floats,
    sums: Floats,
) -> Floats:
    found = np.empty((len(responses), len(blurs)))
    direct = np.empty(waves.shape[3], dtype=np.float32)
    for n in range(len(responses)):
        middle, skew = (middles[n, 0], middles[n, 1]), (footprints[n, 2], footprints[n, 3])
        for place in range(len(blurs)):
            height = np.hypot(footprints[n, 0], blurs[place])
            width = np.hypot(footprints[n, 1], blurs[place])
            _put_direct(middle, (height, width), skew, waves, sums, direct)
            found[n, place] = power_along(responses, n, roots, direct)
    return found


@compiled
def _put_slopes(
    middle: float,
    width: float,
    step: float,
    axis: int,
    waves: Floats,
    sums: Floats,
    found: Floats,
) -> None:
    """Write the mean waves over a box along an axis and their slopes to found[axis], (4, R)."""
    reach = waves.shape[2] // 2
    here = ends_of_box(middle, width, reach)
    before = ends_of_box(middle - step, width, reach)
    after = ends_of_box(middle + step, width, reach)
    per_pixel = np.float32(0.5 / step)
    for r in range(found.shape[2]):
        found[axis, 0, r] = _mean_wave(here, axis, 0, r, waves, sums)
        found[axis, 1, r] = _mean_wave(here, axis, 1, r, waves, sums)
    for r in range(found.shape[2]):
        cosine = _mean_wave(after, axis, 0, r, waves, sums)
        sine = _mean_wave(after, axis, 1, r, waves, sums)
        found[axis, 2, r] = (cosine - _mean_wave(before, axis, 0, r, waves, sums)) * per_pixel
        found[axis, 3, r] = (sine - _mean_wave(before, axis, 1, r, waves, sums)) * per_pixel


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
    count = waves.shape[3]
    # Of each axis, the mean waves and their slopes: cosines and sines.
    means = np.empty((2, 4, count), dtype=np.float32)
    for n in range(len(middles)):
        slanted = footprints[n, 2] != 0.0 or footprints[n, 3] != 0.0
        share = np.float32(0.5 if slanted else 1.0)
        for g in range(first, first + 3):
            for r in range(count):
                found[n, g, r] = 0.0
        for box in range(2 if slanted else 1):
            for axis in range(2):
                middle = middles[n, axis] + footprints[n, 2 + axis] * (2.0 * box - 1.0)
                width = max(footprints[n, axis], LEAST_WIDTH)
                _put_slopes(middle, width, step, axis, waves, sums, means)
            for r in range(count):
                y_cosine, y_sine = means[0, 0, r], means[0, 1, r]
                x_cosine, x_sine = means[1, 0, r], means[1, 1, r]
                down = means[0, 2, r] * x_cosine + means[0, 3, r] * x_sine
                across = y_cosine * means[1, 2, r] + y_sine * means[1, 3, r]
                found[n, first, r] += share * (y_cosine * x_cosine + y_sine * x_sine)
                found[n, first + 1, r] += share * down
                found[n, first + 2, r] += share * across


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
    responses: Floats,
    roots: Floats,
    middles: Floats,
    footprints: Floats,
    blurs: Floats,
    table: WaveTable,
) -> Floats:
    """Return how much of the power of responses direct light of footprints explains, (n, S).

    It is not negative; float64.

    Parameters
    ----------
    responses : ndarray, shape (n, channels, R), float32
        Measured, in units of their noise.
    roots : ndarray, shape (R,), float32
        One measurement's noise in units of each response's.
    middles, footprints, table
        As in `of_boxes`.
    blurs : ndarray, shape (S,), float64
        Widths of boxes that the footprints are blurred by.
    """
    both = _as_doubles(middles), _as_doubles(footprints)
    return np.asarray(_explained(responses, roots, *both, blurs, table.waves, table.sums))


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
