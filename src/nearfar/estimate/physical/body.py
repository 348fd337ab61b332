"""Where light falls on a translucent body, and how its camera pixels respond to waves.

Lengths are in cells (`nearfar.estimate.physical.cells`).

Index convention: c runs over the body's camera pixels, o over offsets of cells, g over groups of
them, k over waves, r over real responses.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import ndimage

from nearfar.arrays import Booleans, Complexes, Floats, Integers, Size, blocks
from nearfar.estimate.physical.cells import (
    REACH,
    SINGLE_REACH,
    camera_pixels_to_a_cell,
    cell_side,
    covered,
    offsets,
    summed,
)
from nearfar.estimate.physical.kernels import Slope, enlarged, kernel
from nearfar.estimate.physical.responses import Responses, Waves, responses
from nearfar.estimate.physical.slants import slanted_footprints
from nearfar.parallel import side_by_side
from nearfar.transport.dipole import Dipole
from nearfar.transport.direct import footprint, spread
from nearfar.transport.model import Transport
from nearfar.transport.near import centre

# A projector pixel lights the body if more than this share of it does.
LEAST_COVERAGE = 0.5
# What the outline's pixels, of which the body covers a part, are worth at least.
OUTLINE_COVERAGE = 0.7
SQUARE = np.ones((3, 3), dtype=bool)
# Samples on each side of a projector pixel, of kernels many of them wide.
CELL_SAMPLES = 3
# Camera pixels of a batch.
BATCH_PIXELS = 4096


@dataclass(frozen=True, eq=False)
class Body:
    """A translucent body, as camera and projector see it.

    Attributes
    ----------
    camera : Size
    pixels : ndarray of int, shape (n,)
        Its camera pixels, those at its outline included, rising.
    inner : ndarray of bool, shape (n,)
        Those that see nothing else.
    coverage : ndarray, shape (Py, Px)
        Share of each projector pixel that lights it.
    covered : ndarray, shape (n, G)
        Mean of the same in groups of cells; 0 beyond the projector's border.
    waves : Waves
    at_offsets : ndarray, shape (O, K), complex
        Waves at the offsets of cells.
    of_footprint : ndarray, shape (n, K), complex
        Responses to unit direct light.
    responses : ndarray, shape (n, channels, R)
    cell_side : int
        Projector pixels along each side of a cell.
    reach : int
        Camera pixels on each side among which slopes are shared.
    """

    camera: Size
    pixels: Integers
    inner: Booleans
    coverage: Floats
    covered: Floats
    waves: Waves
    at_offsets: Complexes
    of_footprint: Complexes
    responses: Floats
    cell_side: int
    reach: int

    def to_kernel(self, source: Dipole, slope: Slope, chosen: Integers) -> Floats:
        """Return the responses of chosen camera pixels to a kernel of unit amplitude.

        A camera pixel sees it from all of its footprint.

        Parameters
        ----------
        source : Dipole
            Lengths in cells.
        slope : (float, float)
        chosen : ndarray of int, shape (m,)
            Indices into `pixels`.

        Returns
        -------
        ndarray, shape (m, R)
        """
        flat = kernel(source, REACH, slope).ravel()
        of_groups = summed(flat, self.at_offsets)
        if self.cell_side > 1:
            of_groups *= self._of_pixels(source, slope) / of_groups.sum(axis=0)
        return self._to_groups(of_groups, chosen)

    def to_offsets(self, light: Floats, chosen: Integers) -> Floats:
        """Return the responses of chosen camera pixels to light of cells at offsets from q.

        A camera pixel sees it from all of its footprint; none comes from beside the body.

        Parameters
        ----------
        light : ndarray, shape (O,)
        chosen : ndarray of int, shape (m,)
            Indices into `pixels`.

        Returns
        -------
        ndarray, shape (m, R)
        """
        return self._to_groups(summed(light, self.at_offsets), chosen)

    def _to_groups(self, of_groups: Complexes, chosen: Integers) -> Floats:
        """Return responses to light whose groups of cells have responses (G, K), shape (m, R)."""
        found = np.empty((len(chosen), len(self.frequency)))

        def work(batch: slice) -> None:
            some = chosen[batch]
            at_q = (self.covered[some] @ of_groups.view(np.float64)).view(np.complex128)
            found[batch] = self.waves.real(np.asarray(at_q * self.of_footprint[some]))

        if len(chosen) <= BATCH_PIXELS:
            # Its product then has all processors.
            work(slice(None))
        else:
            side_by_side(work, blocks(len(chosen), BATCH_PIXELS))
        return found

    def _of_pixels(self, source: Dipole, slope: Slope) -> Complexes:
        """Return the responses to a kernel over single projector pixels, shape (K,)."""
        down, across = self._along_axes
        radius, near = len(down) // 2, SINGLE_REACH * self.cell_side
        single = enlarged(source, self.cell_side)
        # Far from q a kernel is even within a projector pixel.
        drawn = kernel(single, radius, slope, 1)
        middle = slice(radius - near, radius + near + 1)
        drawn[middle, middle] = kernel(single, near, slope, CELL_SAMPLES)
        by_rows = (drawn @ across.view(np.float64)).view(np.complex128)
        return np.asarray(np.sum(down * by_rows, axis=0))

    @cached_property
    def _along_axes(self) -> tuple[Complexes, Complexes]:
        """Waves at offsets of single projector pixels down and across, (n, K) each."""
        radius = REACH * self.cell_side + self.cell_side // 2
        pixels = np.arange(-radius, radius + 1)
        down, across = (np.exp(2j * np.pi * np.outer(pixels, k)) for k in self.waves.cycles.T)
        return down, across

    @cached_property
    def to_direct(self) -> Floats:
        """Responses to unit direct light, shape (n, R)."""
        found: Floats = self.waves.real(self.of_footprint)
        return found

    @cached_property
    def frequency(self) -> Floats:
        """Cycles per cell of each response, shape (R,)."""
        return np.asarray(self.cell_side * np.hypot(*self.waves.of_responses.T))

    def share(self, values: Floats) -> Floats:
        """Return means of values (n,) over the body's camera pixels about each, shape (n,)."""
        sums = [np.zeros(self.camera) for _ in range(2)]
        sums[0].ravel()[self.pixels] = values
        sums[1].ravel()[self.pixels] = 1.0
        side = 2 * self.reach + 1
        total, count = (ndimage.uniform_filter(one, side, mode="constant") for one in sums)
        mean = total / np.maximum(count, 0.5 / side**2)
        return np.asarray(mean.ravel()[self.pixels])


def coverage_of(transport: Transport, seen: Booleans) -> Floats:
    """Return the share of each projector pixel that lights chosen camera pixels, (Py, Px).

    Projector pixels that no camera pixel sees directly are taken for those next to them.
    """
    projector = transport.projector
    where = footprint(transport.correspondence, projector)
    lit = transport.lit.ravel()
    chosen, all_of_them = (
        spread(mask.astype(np.float64), where, projector) for mask in (seen.ravel() & lit, lit)
    )
    known = (all_of_them > 0).reshape(projector)
    share = (chosen / np.maximum(all_of_them, np.finfo(float).tiny)).reshape(projector)
    nearest = ndimage.distance_transform_edt(~known, return_distances=False, return_indices=True)
    return np.asarray(share[tuple(nearest)])


def bodies_at(transport: Transport, seen: Booleans, boxes: Floats, waves: Waves) -> Iterator[Body]:
    """Yield the bodies that camera pixels see, which do not touch, with their responses.

    Parameters
    ----------
    transport : Transport
    seen : ndarray of bool, shape (Cy, Cx)
        Camera pixels that see a body, with direct light.
    boxes : ndarray, shape (C, 4)
        Footprints of direct light, as `Transport.boxes` has them.
    waves : Waves
    """
    lit = transport.lit
    labels, count = ndimage.label(seen, SQUARE)
    if not count:
        return
    finer = camera_pixels_to_a_cell(transport)

    def grown(mask: Booleans) -> Booleans:
        # Outlines cross camera pixels as large as a cell.
        return np.asarray(ndimage.binary_dilation(mask, SQUARE, iterations=finer) & lit)

    pixels = np.flatnonzero(grown(seen))
    rounded = centre(transport.correspondence, transport.projector)[pixels]
    shown = _shown(transport, pixels, rounded, waves, boxes)
    for number in range(1, count + 1):
        mine = labels == number
        with_outline = grown(mine)
        its = shown.of(np.searchsorted(pixels, np.flatnonzero(with_outline)))
        yield _body(transport, mine, with_outline, waves, its, finer)


def _shown(
    transport: Transport, pixels: Integers, rounded: Integers, waves: Waves, boxes: Floats
) -> Responses:
    """Return responses of camera pixels, with direct light through all of slanted footprints.

    An estimate takes direct light to come from the projector pixels next to q. Of a slanted
    footprint the rest would be taken for light under the surface.
    """
    shown = responses(transport, pixels, rounded, waves, boxes[pixels])
    chosen = np.zeros(transport.camera.pixels, dtype=bool)
    chosen[pixels] = True
    slanted = slanted_footprints(transport, chosen)
    mine = np.searchsorted(pixels, slanted.pixels)
    to_direct = shown.to_direct.copy()
    to_direct[mine] = slanted.to_waves(rounded[mine], waves)
    return shown._replace(to_direct=to_direct)


def _body(
    transport: Transport,
    seen: Booleans,
    grown: Booleans,
    waves: Waves,
    shown: Responses,
    finer: int,
) -> Body:
    """Gather what a body is fitted to; its responses are given."""
    projector, side = transport.projector, cell_side(transport)
    inside = coverage_of(transport, seen)
    about = OUTLINE_COVERAGE * (coverage_of(transport, grown) > LEAST_COVERAGE)
    coverage = np.maximum(inside, about)
    pixels = np.flatnonzero(grown)
    rounded = centre(transport.correspondence, projector)[pixels]
    return Body(
        camera=transport.camera,
        pixels=pixels,
        inner=seen.ravel()[pixels],
        coverage=coverage,
        covered=covered(coverage, rounded, side),
        waves=waves,
        at_offsets=waves.at(side * offsets()),
        of_footprint=shown.to_direct,
        responses=shown.total,
        cell_side=side,
        reach=finer,
    )


def with_wider_cells(body: Body, transport: Transport) -> Body:
    """Return a body of a transport with cells twice as wide, so that kernels reach twice as far."""
    side = 2 * body.cell_side
    rounded = centre(transport.correspondence, transport.projector)[body.pixels]
    return replace(
        body,
        covered=covered(body.coverage, rounded, side),
        at_offsets=body.waves.at(side * offsets()),
        cell_side=side,
        reach=2 * body.reach,
    )
