"""Pictures by runs of projector pixels, from the factors of a transport.

Direct light is summed pixel by pixel and near-range light over the part of its window, or of its
hats, that the runs hold. Far-range light is f times sums of light times each of its functions; over
a run such a sum is the difference of two sums along a projector row, so that rows of T are not
drawn.

Index convention: c runs over camera pixels, m over functions of far-range light.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from nearfar.applications import run_loops
from nearfar.applications.shapes import Band, Disc, Runs
from nearfar.arrays import Floats, Size, blocks
from nearfar.illumination.real_basis import RealBasis
from nearfar.parallel import side_by_side
from nearfar.transport.boxes import halves
from nearfar.transport.factors import Factors

# Bytes of sums along rows that are kept at once. Those of `FUNCTIONS_TOGETHER` are kept at least,
# 1.6 GB for a projector of 1080x1920; with fewer, each block of camera pixels would sum again.
TABLE_BYTES = 2**27
# Functions whose sums lie side by side: few enough for those of a disc to stay in a cache.
FUNCTIONS_TOGETHER = 192
BATCH_PIXELS = 2048
# Of float32 in a cache line.
FLOATS_OF_LINE = 16
# Projector rows that a thread sums at a time.
LINES_AT_ONCE = 8


class _Table(NamedTuple):
    """Sums along rows of light times some functions of far-range light.

    Attributes
    ----------
    functions : slice
    sums : ndarray, shape (Py, Px + 1, m or more), float32
        Before each column; the last axis is padded.
    """

    functions: slice
    sums: Floats


@dataclass(frozen=True, eq=False)
class SummedLight:
    """A light summed along projector rows, for the camera pixels of a transport.

    Attributes
    ----------
    light : ndarray, shape (Py, Px), float32
    basis : RealBasis
        Of far-range light.
    """

    light: Floats
    basis: RealBasis

    @cached_property
    def moments(self) -> tuple[Floats, Floats]:
        """Sums of the light, and of the light times column, before each column, (Py, Px + 1)."""
        found = []
        for values in (self.light, self.light * np.arange(self.light.shape[1])):
            sums = np.zeros((len(values), values.shape[1] + 1))
            np.cumsum(values, axis=1, out=sums[:, 1:])
            found.append(sums)
        return found[0], found[1]

    def tables(self) -> Iterator[list[_Table]]:
        """Yield sums of all functions of far-range light, as many at a time as memory allows."""
        bytes_each = 4 * (self.light.size + len(self.light))
        at_once = max(1, TABLE_BYTES // (bytes_each * FUNCTIONS_TOGETHER)) * FUNCTIONS_TOGETHER
        if self.basis.count <= at_once:
            yield self._all_tables
            return
        for some in blocks(self.basis.count, at_once):
            yield self._tables_of(some)

    @cached_property
    def _all_tables(self) -> list[_Table]:
        return self._tables_of(slice(0, self.basis.count))

    def _tables_of(self, functions: slice) -> list[_Table]:
        parts = blocks(functions.stop - functions.start, FUNCTIONS_TOGETHER)
        moved = [slice(functions.start + p.start, functions.start + p.stop) for p in parts]
        return [_Table(one, self._summed(one)) for one in moved]

    def _summed(self, functions: slice) -> Floats:
        height, width = self.light.shape
        cycles = self.basis.cycles[self.basis.index[functions]]
        waves = [
            np.exp(2j * np.pi * (np.arange(side)[:, None] * along % 1.0)).astype(np.complex64)
            for side, along in zip(self.light.shape, cycles.T, strict=True)
        ]
        # cos(a + b) = cos a cos b - sin a sin b, and sin(a + b) = cos a sin b + sin a cos b.
        sine = self.basis.is_sine[functions]
        y, x = (np.stack([wave.real, wave.imag]) for wave in waves)
        y *= self.basis.weights[functions].astype(np.float32)
        down = (y[0], np.where(sine, y[1], -y[1]))
        across = (np.where(sine, x[1], x[0]), np.where(sine, x[0], x[1]))
        table = _aligned((height, width + 1, len(sine)))

        def work(lines: slice) -> None:
            run_loops.sum_along_rows(self.light[lines], down, across, lines.start, table[lines])

        side_by_side(work, blocks(height, LINES_AT_ONCE))
        return table


def _aligned(shape: tuple[int, int, int]) -> Floats:
    """Return an array whose last axis is longer, so that each of its rows starts a cache line.

    Sums over such rows take three quarters of the time.
    """
    high, wide, count = shape
    padded = -(-count // FLOATS_OF_LINE) * FLOATS_OF_LINE
    length = high * wide * padded
    flat = np.empty(length + FLOATS_OF_LINE, dtype=np.float32)
    first = -flat.ctypes.data // flat.itemsize % FLOATS_OF_LINE
    return flat[first : first + length].reshape(high, wide, padded)


def summed_lights(flat: Floats, basis: RealBasis) -> list[SummedLight]:
    """Prepare a light (1, P) for all channels, or (channels, P): one of each."""
    return [
        SummedLight(np.ascontiguousarray(one.reshape(basis.projector), dtype=np.float32), basis)
        for one in flat
    ]


@dataclass(frozen=True, eq=False)
class RunsOfCamera:
    """The runs of camera pixels from `start` on, of shapes with signs.

    Attributes
    ----------
    shapes : list of (int, Disc or Band)
    q : ndarray, shape (C, 2)
    start : int
        First of these pixels among those of the whole camera.
    camera, projector : Size
        Of the whole camera.
    """

    shapes: list[tuple[int, Disc | Band]]
    q: Floats
    start: int
    camera: Size
    projector: Size

    def of(self, batch: slice) -> list[tuple[int, Runs]]:
        """Return the runs of some of the camera pixels, with the signs of their shapes."""
        pixels = slice(self.start + batch.start, self.start + batch.stop)
        return [
            (sign, shape.runs(pixels, self.q[batch], self.camera, self.projector))
            for sign, shape in self.shapes
        ]


def picture_by_runs(factors: Factors, lights: list[SummedLight], runs: RunsOfCamera) -> Floats:
    """Return the picture (C, channels) of the projector pixels in runs, float32.

    Parameters
    ----------
    factors : Factors
        Of these camera pixels.
    lights : list of SummedLight
        One for all channels, or one for each.
    runs : RunsOfCamera
    """
    out = np.zeros(factors.direct.shape, dtype=np.float32)
    for place, light in enumerate(lights):
        part = factors if len(lights) == 1 else factors.of_channel(place)
        found = np.zeros(part.direct.shape, dtype=np.float32)
        _add_all(part, light, runs, found)
        out[:, slice(place, place + 1) if len(lights) > 1 else slice(None)] = found
    return out


def _add_all(factors: Factors, light: SummedLight, runs: RunsOfCamera, out: Floats) -> None:
    add_about_q = _add_single_pixels if factors.of_single_pixels else _add_hats
    for number, tables in enumerate(light.tables()):

        def work(
            batch: slice, tables: list[_Table] = tables, with_about_q: bool = number == 0
        ) -> None:
            far = [_floats(factors.far[batch, :, functions]) for functions, _ in tables]
            for sign, found in runs.of(batch):
                part = np.zeros_like(out[batch])
                if with_about_q:
                    add_about_q(factors, light, batch, found, part)
                for own, (_, sums) in zip(far, tables, strict=True):
                    run_loops.add_far(sums, own, *found, part)
                out[batch] += sign * part

        side_by_side(work, blocks(len(out), BATCH_PIXELS))


def _add_single_pixels(
    factors: Factors, light: SummedLight, batch: slice, runs: Runs, out: Floats
) -> None:
    """Add direct and near-range light where this is of single projector pixels."""
    side, where = factors.near_basis.window, factors.footprint
    direct, near = _floats(factors.direct[batch]), _floats(factors.near[batch])
    corners = (where.pixels[batch], where.weights[batch])
    run_loops.add_corners(light.light, direct, *corners, *runs, out)
    window = near.reshape(*direct.shape, side, side)
    run_loops.add_window(light.light, window, factors.centres[batch], *runs, out)


def _add_hats(factors: Factors, light: SummedLight, batch: slice, runs: Runs, out: Floats) -> None:
    """Add direct light of boxes, and near-range light of hats."""
    basis = factors.near_basis
    direct, near = _floats(factors.direct[batch]), _floats(factors.near[batch])
    middles, sides = halves(factors.q[batch], factors.boxes[batch])
    run_loops.add_boxes(light.light, direct, middles, sides, *runs, out)
    for pitch in basis.rising_pitches:
        hats = near[..., basis.pitches == pitch]
        if pitch != basis.pitch:
            # No hat of a finer pitch stands at q itself.
            hats = np.insert(hats, hats.shape[2] // 2, 0.0, axis=2)
        side = round(np.sqrt(hats.shape[2]))
        grid = np.ascontiguousarray(hats).reshape(*direct.shape, side, side)
        run_loops.add_hats(light.moments, grid, pitch, factors.centres[batch], *runs, out)


def _floats(values: Floats) -> Floats:
    return np.ascontiguousarray(values, dtype=np.float32)
