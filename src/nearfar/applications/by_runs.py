"""Pictures by runs of projector pixels, from the factors of a transport.

Direct light is summed pixel by pixel and near-range light over the part of its window, or of its
hats, that the runs hold. Far-range light is f times sums of light times each of its functions; over
a run such a sum is the difference of two sums along a projector row, so that rows of T are not
drawn. Sums over discs that are large beside the distances between camera pixels are taken at a grid
of places, and interpolated at each q.

Index convention: c runs over camera pixels, m over functions of far-range light.
"""

import math
from dataclasses import dataclass

import numpy as np

from nearfar.applications import run_loops
from nearfar.applications.shapes import Band, Disc, Runs
from nearfar.applications.summed_light import HatSums, SummedLight, Table, grid_of_places
from nearfar.arrays import Floats, Integers, Size, blocks
from nearfar.illumination.near_basis import NearBasis
from nearfar.parallel import side_by_side
from nearfar.transport.boxes import halves
from nearfar.transport.factors import Factors

# Camera pixels of a batch, whose sums stay in a cache.
BATCH_PIXELS = 1024
# Sums over a disc are interpolated where that takes at most this many places for a camera pixel,
# and where its radius is at least this, in projector pixels: of the few pixels at the edge of a
# smaller disc each matters.
MOST_PLACES_OF_PIXEL = 0.5
LEAST_INTERPOLATED_RADIUS = 32


@dataclass(frozen=True, eq=False)
class RunsOfCamera:
    """The runs of camera pixels from `start` on, of shapes with signs.

    Attributes
    ----------
    shapes : list of (int, Disc or Band)
    q : ndarray, shape (C, 2)
    start : int
        First of these pixels among those of the whole camera.
    camera : Size
        Of the whole camera, or of as much of it as is probed.
    projector : Size
    """

    shapes: list[tuple[int, Disc | Band]]
    q: Floats
    start: int
    camera: Size
    projector: Size

    def of(self, shape: Disc | Band, batch: slice) -> Runs:
        """Return the runs of a shape, of some of these camera pixels."""
        pixels = slice(self.start + batch.start, self.start + batch.stop)
        return shape.runs(pixels, self.q[batch], self.camera, self.projector)

    def lines(self, shapes: list[Disc | Band]) -> slice:
        """Return the projector rows in which shapes have runs, and perhaps some more."""
        found = [shape.lines(self.q, self.projector) for shape in shapes]
        return slice(min(one.start for one in found), max(one.stop for one in found))

    def is_interpolated(self, disc: Disc) -> bool:
        """Whether sums over a disc are taken at few places, and interpolated at each q."""
        if disc.radius < LEAST_INTERPOLATED_RADIUS:
            return False
        _, places = grid_of_places(disc.radius, self.projector)
        if places.pixels > MOST_PLACES_OF_PIXEL * self.camera.pixels:
            return False
        edges = np.array(self.projector) - 0.5
        return not bool(((self.q < -0.5) | (self.q > edges)).any())


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
    """Add all light: about q and of interpolated discs first, then far-range light row by row."""
    by_rows, interpolated = _by_size(runs, light)
    hats = light.hats
    discs = [(sign, light.of_disc(disc)) for sign, disc in interpolated]

    def but_row_by_row(batch: slice) -> None:
        _add_about_q(factors, light.light, hats, runs, batch, out[batch])
        if not discs:
            return
        far = _floats(factors.far[batch])
        sums = np.zeros((len(far), far.shape[2]), dtype=np.float32)
        for sign, disc in discs:
            run_loops.add_between(*disc, sign, runs.q[batch], sums)
        run_loops.add_products(far, sums, out[batch])

    side_by_side(but_row_by_row, blocks(len(out), BATCH_PIXELS))
    for table in light.tables(runs.lines([shape for _, shape in by_rows])) if by_rows else ():

        def work(batch: slice, table: Table = table) -> None:
            far = _floats(factors.far[batch, :, table.functions])
            sums = np.zeros((len(far), far.shape[2]), dtype=np.float32)
            for sign, shape in by_rows:
                first, starts, stops = runs.of(shape, batch)
                run_loops.add_runs(table.sums, sign, first - table.first, starts, stops, sums)
            run_loops.add_products(far, sums, out[batch])

        side_by_side(work, blocks(len(out), BATCH_PIXELS))


def _add_about_q(
    factors: Factors,
    light: Floats,
    hats: HatSums | None,
    runs: RunsOfCamera,
    batch: slice,
    out: Floats,
) -> None:
    """Add direct and near-range light."""
    for sign, shape in runs.shapes:
        part, own = np.zeros_like(out), runs.of(shape, batch)
        if hats is None:
            _add_single_pixels(factors, light, batch, own, part)
        else:
            _add_boxes(factors, light, batch, own, part)
            _add_hats(factors, hats, batch, shape, own, part)
        out += sign * part


def _by_size(
    runs: RunsOfCamera, light: SummedLight
) -> tuple[list[tuple[int, Disc | Band]], list[tuple[int, Disc]]]:
    """Return the shapes that are summed row by row, and the discs that are interpolated."""
    by_rows, interpolated = [], []
    for sign, shape in runs.shapes:
        if isinstance(shape, Disc) and light.takes_places(shape) and runs.is_interpolated(shape):
            interpolated.append((sign, shape))
        else:
            by_rows.append((sign, shape))
    return by_rows, interpolated


def _add_single_pixels(
    factors: Factors, light: Floats, batch: slice, runs: Runs, out: Floats
) -> None:
    """Add direct and near-range light where this is of single projector pixels."""
    side, where = factors.near_basis.window, factors.footprint
    direct, near = _floats(factors.direct[batch]), _floats(factors.near[batch])
    corners = (where.pixels[batch], where.weights[batch])
    run_loops.add_corners(light, direct, *corners, *runs, out)
    if factors.second is not None:
        second = factors.second.of(batch, len(factors.q))
        its = Runs(*(values[second.pixels] for values in runs))
        found = np.zeros((len(second.pixels), direct.shape[1]), dtype=np.float32)
        run_loops.add_corners(light, _floats(second.direct), *second.where, *its, found)
        out[second.pixels] += found
    window = near.reshape(*direct.shape, side, side)
    run_loops.add_window(light, window, factors.centres[batch], *runs, out)


def _add_boxes(factors: Factors, light: Floats, batch: slice, runs: Runs, out: Floats) -> None:
    """Add direct light of boxes."""
    middles, sides = halves(factors.q[batch], factors.boxes[batch])
    run_loops.add_boxes(light, _floats(factors.direct[batch]), middles, sides, *runs, out)


def _add_hats(
    factors: Factors, hats: HatSums, batch: slice, shape: Disc | Band, runs: Runs, out: Floats
) -> None:
    """Add near-range light of hats."""
    basis, centres = factors.near_basis, factors.centres[batch]
    lit = np.isfinite(factors.q[batch]).all(axis=1, keepdims=True)
    places = hats.pyramid.places(centres)[:, None]
    for pitch in basis.rising_pitches:
        chosen = np.flatnonzero(basis.pitches == pitch)
        if not len(chosen):
            continue
        if _holds_hats(shape, basis, pitch):
            seen = hats.levels[places + hats.pyramid.steps[chosen]] * lit
        else:
            seen = _summed_hats(hats, pitch, len(chosen), centres, runs)
        near = factors.near[batch, :, chosen[0] : chosen[-1] + 1]
        run_loops.add_products(_floats(near), _floats(seen), out)


def _summed_hats(hats: HatSums, pitch: int, count: int, centres: Integers, runs: Runs) -> Floats:
    """Return sums of light times `count` hats of one pitch, over runs, (n, count)."""
    side = math.isqrt(count - 1) + 1
    found = np.empty((len(centres), side, side), dtype=np.float32)
    run_loops.sum_hats(hats.moments, pitch, centres, *runs, found)
    flat = found.reshape(len(centres), side**2)
    # No hat of a finer pitch stands at q itself.
    return flat if count == side**2 else np.delete(flat, side**2 // 2, axis=1)


def _holds_hats(shape: Disc | Band, basis: NearBasis, pitch: int) -> bool:
    """Whether all hats of one pitch are in a disc wherever q is."""
    # From the rounded q to the farthest pixel of a hat, along each axis.
    reach = np.abs(basis.offsets[basis.pitches == pitch]).max() + pitch - 1
    return isinstance(shape, Disc) and bool(np.hypot(reach + 0.5, reach + 0.5) < shape.radius)


def _floats(values: Floats) -> Floats:
    return np.ascontiguousarray(values, dtype=np.float32)
