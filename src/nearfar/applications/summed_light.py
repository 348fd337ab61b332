"""Sums of a light times functions of far-range light, along projector rows and over discs.

Index convention: m runs over functions of far-range light.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from nearfar.applications import run_loops
from nearfar.applications.shapes import Disc
from nearfar.arrays import Floats, Size, blocks
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import RealBasis
from nearfar.parallel import side_by_side
from nearfar.transport.factors import Factors
from nearfar.transport.pyramid import Pyramid

# Bytes of a table up to which it has more projector rows than are asked for, for the next camera
# pixels.
TABLE_BYTES = 2**27
# Functions whose sums lie side by side: few enough for those of a disc to stay in a cache.
FUNCTIONS_TOGETHER = 192
# Of float32 in a cache line.
FLOATS_OF_LINE = 16
# Projector rows that a thread sums at a time.
LINES_AT_ONCE = 8
# Distance between neighbouring places at which sums over a disc are taken, as a share of its
# radius. The edge of the disc is blurred by about this distance.
SPACING_OF_RADIUS = 1 / 16
# Bytes of the sums at all places up to which they are taken.
PLACES_BYTES = 2**27
# Places summed at a time.
BATCH_PLACES = 512


class Table(NamedTuple):
    """Sums along projector rows of light times some functions of far-range light.

    Attributes
    ----------
    functions : slice
    first : int
        First projector row.
    sums : ndarray, shape (rows, Px + 1, m or more), float32
        Before each column; the last axis is padded.
    """

    functions: slice
    first: int
    sums: Floats

    def has(self, lines: slice) -> bool:
        """Whether it has some projector rows."""
        return bool(self.first <= lines.start and lines.stop <= self.first + len(self.sums))


class SumsOfDisc(NamedTuple):
    """Sums over a disc of light times each function, at a grid of places of its middle.

    Attributes
    ----------
    sums : ndarray, shape (rows, columns, M), float32
    first, spacing : float
        Place of the first row and column, and the distance between two; projector pixels.
    """

    sums: Floats
    first: float
    spacing: float


class HatSums(NamedTuple):
    """What hats read of a light.

    Attributes
    ----------
    moments : tuple of ndarray, shape (Py, Px + 1), float64
        Sums of the light, and of the light times column, along projector rows before each column.
    pyramid : Pyramid
        Where they read the light that is blurred by them.
    levels : ndarray
        The light blurred by the hat of each pitch, flat; see `Pyramid`.
    """

    moments: tuple[Floats, Floats]
    pyramid: Pyramid
    levels: Floats


def grid_of_places(radius: float, projector: Size) -> tuple[float, Size]:
    """Return the first place of a disc's middle along each axis, and how many there are.

    The first lies one place before the projector's edge, and the last two or three after the other
    edge, for cubic convolution.
    """
    spacing = radius * SPACING_OF_RADIUS
    rows, columns = (int(side / spacing) + 5 for side in projector)
    return -0.5 - spacing, Size(rows, columns)


@dataclass(frozen=True, eq=False)
class SummedLight:
    """A light summed along projector rows, for the camera pixels of a transport.

    Attributes
    ----------
    light : ndarray, shape (Py, Px), float32
    basis : RealBasis
        Of far-range light.
    near_basis : NearBasis
    """

    light: Floats
    basis: RealBasis
    near_basis: NearBasis
    _of_discs: dict[float, SumsOfDisc] = field(default_factory=dict, init=False, repr=False)
    _kept: list[Table] = field(default_factory=list, init=False, repr=False)

    @cached_property
    def hats(self) -> HatSums | None:
        """What hats read of the light; None where near-range light is of single pixels."""
        if self.near_basis.pitch == 1:
            return None
        moments = []
        for values in (self.light, self.light * np.arange(self.light.shape[1])):
            sums = np.zeros((len(values), values.shape[1] + 1))
            np.cumsum(values, axis=1, out=sums[:, 1:])
            moments.append(sums)
        pyramid = Pyramid(self.near_basis, self.basis.projector)
        return HatSums((moments[0], moments[1]), pyramid, pyramid.levels(self.light))

    def tables(self, lines: slice) -> Iterator[Table]:
        """Yield sums along projector rows of some functions at a time, until all were there.

        The last ones are kept where one table holds all functions, or all are small. They serve
        again for rows that they have.

        Parameters
        ----------
        lines : slice
            Projector rows that are needed.
        """
        if self._kept and self._kept[0].has(lines):
            yield from self._kept
            return
        lines = self._with_more(lines)
        bytes_of_lines = (lines.stop - lines.start) * self._bytes_of_line
        made = (self._table(some, lines) for some in blocks(self.basis.count, FUNCTIONS_TOGETHER))
        if self.basis.count > FUNCTIONS_TOGETHER and bytes_of_lines > TABLE_BYTES:
            yield from made
            return
        self._kept.clear()
        self._kept.extend(list(made))
        yield from self._kept

    def _with_more(self, lines: slice) -> slice:
        """Return rows about those needed: all if most are, else as many as `TABLE_BYTES` hold."""
        height, count = len(self.light), lines.stop - lines.start
        if 2 * count > height or height * self._bytes_of_line <= TABLE_BYTES:
            return slice(0, height)
        more = max(0, TABLE_BYTES // self._bytes_of_line - count) // 2
        return slice(max(0, lines.start - more), min(height, lines.stop + more))

    def takes_places(self, disc: Disc) -> bool:
        """Whether the sums over a disc at its places are few enough to be kept."""
        _, places = grid_of_places(disc.radius, self.basis.projector)
        return 4 * self.basis.count * places.pixels <= PLACES_BYTES

    def of_disc(self, disc: Disc) -> SumsOfDisc:
        """Return the sums over a disc about a grid of places; they are kept."""
        if disc.radius not in self._of_discs:
            self._of_discs[disc.radius] = self._summed_over(disc)
        return self._of_discs[disc.radius]

    def _summed_over(self, disc: Disc) -> SumsOfDisc:
        projector = self.basis.projector
        first, places = grid_of_places(disc.radius, projector)
        spacing = disc.radius * SPACING_OF_RADIUS
        q = first + spacing * np.moveaxis(np.indices(places), 0, -1).reshape(-1, 2)
        sums = np.zeros((len(q), self.basis.count), dtype=np.float32)
        bytes_of_function = 4 * (self.light.size + len(self.light))
        cache_lines = max(1, TABLE_BYTES // (bytes_of_function * FLOATS_OF_LINE))
        at_once = min(cache_lines * FLOATS_OF_LINE, FUNCTIONS_TOGETHER)
        for functions in blocks(self.basis.count, at_once):
            table = self._table(functions, slice(0, projector.height))

            def work(batch: slice, table: Table = table) -> None:
                runs = disc.runs(batch, q[batch], places, projector)
                run_loops.add_runs(table.sums, 1, *runs, sums[batch, table.functions])

            side_by_side(work, blocks(len(q), BATCH_PLACES))
        return SumsOfDisc(sums.reshape(*places, -1), first, spacing)

    @property
    def _bytes_of_line(self) -> int:
        """Bytes of the sums of all functions along a projector row."""
        return 4 * self.basis.count * int(self.light.shape[1] + 1)

    def _table(self, functions: slice, lines: slice) -> Table:
        light, width = self.light[lines], self.light.shape[1]
        cycles = self.basis.cycles[self.basis.index[functions]]
        waves = [
            np.exp(2j * np.pi * (places[:, None] * along % 1.0)).astype(np.complex64)
            for places, along in zip(
                (np.arange(lines.start, lines.stop), np.arange(width)), cycles.T, strict=True
            )
        ]
        # cos(a + b) = cos a cos b - sin a sin b, and sin(a + b) = cos a sin b + sin a cos b.
        sine = self.basis.is_sine[functions]
        y, x = (np.stack([wave.real, wave.imag]) for wave in waves)
        y *= self.basis.weights[functions].astype(np.float32)
        down = (y[0], np.where(sine, y[1], -y[1]))
        across = (np.where(sine, x[1], x[0]), np.where(sine, x[0], x[1]))
        sums = _aligned((len(light), width + 1, len(sine)))

        def work(some: slice) -> None:
            of_some = (down[0][some], down[1][some])
            run_loops.sum_along_rows(light[some], of_some, across, sums[some])

        side_by_side(work, blocks(len(light), LINES_AT_ONCE))
        return Table(functions, lines.start, sums)


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


def summed_lights(flat: Floats, factors: Factors) -> list[SummedLight]:
    """Prepare a light (1, P) for all channels, or (channels, P): one of each.

    Parameters
    ----------
    flat : ndarray
    factors : Factors
        Of any camera pixels of a transport.
    """
    lights = [np.ascontiguousarray(one.reshape(factors.projector), np.float32) for one in flat]
    return [SummedLight(light, factors.far_basis, factors.near_basis) for light in lights]
