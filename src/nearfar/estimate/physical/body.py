"""Where light falls on a translucent body, and how its kernel meets the rows of camera pixels.

Index convention: c runs over the body's camera pixels, o over `offsets`, j over the 3 x 3 projector
pixels about the rounded q.
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from nearfar.arrays import Booleans, Floats, Integers, Size
from nearfar.estimate.physical.rows_about import REACH, offsets, on_projector, rows_about_q
from nearfar.illumination.near_basis import window_offsets
from nearfar.transport.direct import direct_weights, footprint, spread
from nearfar.transport.model import Transport
from nearfar.transport.near import centre

# Projector pixels from q that kernels need to meet rows about it.
KERNEL_RADIUS = REACH + 1
# A projector pixel lights the body if more than this share of it does.
LEAST_COVERAGE = 0.5
# What the outline's pixels, of which the body covers a part, are worth at least.
OUTLINE_COVERAGE = 0.7
SQUARE = np.ones((3, 3), dtype=bool)


@dataclass(frozen=True, eq=False)
class Body:
    """A translucent body, as camera and projector see it.

    Attributes
    ----------
    camera : Size
    pixels : ndarray of int, shape (n,)
        Its camera pixels, those at its outline included.
    inner : ndarray of bool, shape (n,)
        Those that see nothing else.
    coverage : ndarray, shape (Py, Px)
        Share of each projector pixel that lights it.
    weights : ndarray, shape (n, 9)
        Bilinear weights of q over the 3 x 3 projector pixels about the rounded q.
    entries : ndarray, shape (n, channels, O)
        Rows about q.
    covered : ndarray, shape (n, O)
        `coverage` at the same places; 0 beyond the projector's border.
    reach : int
        Camera pixels on each side among which slope and amplitude are shared.
    """

    camera: Size
    pixels: Integers
    inner: Booleans
    coverage: Floats
    weights: Floats
    entries: Floats
    covered: Floats
    reach: int

    def meet(self, kernel: Floats) -> Floats:
        """Return a kernel at the offsets of each row, shape (n, O).

        Parameters
        ----------
        kernel : ndarray, shape (2 r + 1, 2 r + 1)
            With r at least `KERNEL_RADIUS`.
        """
        middle = kernel.shape[0] // 2
        steps = middle + offsets()[None] - window_offsets(3)[:, None]
        return np.asarray(self.weights @ kernel[steps[..., 0], steps[..., 1]]) * self.covered

    @property
    def footprint(self) -> Booleans:
        """Offsets that have direct light, shape (n, O)."""
        steps = offsets()
        near = np.all(np.abs(steps) <= 1, axis=1)
        found = np.zeros(self.covered.shape, dtype=bool)
        places = (steps[near] + 1) @ np.array([3, 1])
        found[:, near] = self.weights[:, places] > 0
        return found

    def share(self, values: Floats, counted: Booleans | None = None) -> Floats:
        """Return means of values (n,) over the body's camera pixels about each, shape (n,)."""
        weight = np.ones(len(values)) if counted is None else counted.astype(np.float64)
        sums = [np.zeros(self.camera) for _ in range(2)]
        sums[0].ravel()[self.pixels] = values * weight
        sums[1].ravel()[self.pixels] = weight
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


def body_at(transport: Transport, seen: Booleans) -> Body:
    """Gather a body's rows.

    Parameters
    ----------
    transport : Transport
    seen : ndarray of bool, shape (Cy, Cx)
        Camera pixels that see it, with direct light.
    """
    projector, camera, lit = transport.projector, transport.camera, transport.lit
    places = transport.correspondence[lit]
    extent = np.prod(np.ptp(places, axis=0) + 1.0)
    finer = max(1, int(np.ceil(np.sqrt(lit.sum() / extent) - 0.25)))
    # Outlines cross camera pixels as large as the projector's.
    grown = ndimage.binary_dilation(seen, SQUARE, iterations=finer) & lit
    inside = coverage_of(transport, seen)
    about = OUTLINE_COVERAGE * (coverage_of(transport, grown) > LEAST_COVERAGE)
    coverage = np.maximum(inside, about)
    parts = list(rows_about_q(transport, grown.ravel()))
    pixels = np.concatenate([pixels for pixels, _ in parts])
    entries = np.concatenate([entries for _, entries in parts])
    centres = centre(transport.correspondence, projector)[pixels]
    around = centres[:, None] + offsets()
    on = on_projector(around, transport)
    held = np.where(on[..., None], around, 0)
    q = transport.correspondence.reshape(-1, 2)[pixels].astype(np.float64)
    return Body(
        camera=camera,
        pixels=pixels,
        inner=seen.ravel()[pixels],
        coverage=coverage,
        weights=np.asarray(direct_weights(np.clip(q, 0, np.array(projector) - 1), centres)[:, 0]),
        entries=entries,
        covered=coverage[held[..., 0], held[..., 1]] * on,
        reach=finer,
    )
