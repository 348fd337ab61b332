"""Where light falls on a translucent body, and how its camera pixels respond to waves.

Index convention: c runs over the body's camera pixels, o over `kernel_offsets`, j over the 3 x 3
projector pixels about the rounded q, r over real responses.
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from nearfar.arrays import Booleans, Floats, Integers, Size
from nearfar.estimate.physical.responses import Waves, responses_about_q
from nearfar.estimate.physical.rows_about import on_projector
from nearfar.illumination.near_basis import window_offsets
from nearfar.transport.direct import direct_weights, footprint, spread
from nearfar.transport.model import Transport
from nearfar.transport.near import centre

# Projector pixels from q up to which light under a surface is compared with responses.
REACH = 8
# A kernel is needed one further, for places between projector pixels.
KERNEL_RADIUS = REACH + 1
# A projector pixel lights the body if more than this share of it does.
LEAST_COVERAGE = 0.5
# What the outline's pixels, of which the body covers a part, are worth at least.
OUTLINE_COVERAGE = 0.7
SQUARE = np.ones((3, 3), dtype=bool)


def kernel_offsets() -> Integers:
    """Return the offsets (y, x) from the rounded q that kernels are compared at, shape (O, 2)."""
    return window_offsets(2 * REACH + 1)


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
    covered : ndarray, shape (n, O)
        The same at `kernel_offsets`; 0 beyond the projector's border.
    weights : ndarray, shape (n, 9)
        Bilinear weights of q over the 3 x 3 projector pixels about the rounded q.
    frequency : ndarray, shape (R,)
        Cycles per projector pixel of each response.
    at_offsets : ndarray, shape (O, R)
        Waves at `kernel_offsets`.
    to_direct : ndarray, shape (n, R)
        Responses to unit direct light.
    responses : ndarray, shape (n, channels, R)
    reach : int
        Camera pixels on each side among which slopes are shared.
    """

    camera: Size
    pixels: Integers
    inner: Booleans
    coverage: Floats
    covered: Floats
    weights: Floats
    frequency: Floats
    at_offsets: Floats
    to_direct: Floats
    responses: Floats
    reach: int

    def to_kernel(self, kernel: Floats, chosen: Integers) -> Floats:
        """Return the responses of chosen camera pixels to a kernel of unit amplitude.

        Parameters
        ----------
        kernel : ndarray, shape (2 KERNEL_RADIUS + 1, 2 KERNEL_RADIUS + 1)
        chosen : ndarray of int, shape (m,)
            Indices into `pixels`.

        Returns
        -------
        ndarray, shape (m, R)
        """
        steps = KERNEL_RADIUS + kernel_offsets() - window_offsets(3)[:, None]
        rows = self.weights[chosen] @ kernel[steps[..., 0], steps[..., 1]]
        return np.asarray((rows * self.covered[chosen]) @ self.at_offsets)

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


def body_at(transport: Transport, seen: Booleans, waves: Waves) -> Body:
    """Gather a body's responses.

    Parameters
    ----------
    transport : Transport
    seen : ndarray of bool, shape (Cy, Cx)
        Camera pixels that see it, with direct light.
    waves : Waves
    """
    projector, lit = transport.projector, transport.lit
    places = transport.correspondence[lit]
    extent = np.prod(np.ptp(places, axis=0) + 1.0)
    finer = max(1, int(np.ceil(np.sqrt(lit.sum() / extent) - 0.25)))
    # Outlines cross camera pixels as large as the projector's.
    grown = ndimage.binary_dilation(seen, SQUARE, iterations=finer) & lit
    inside = coverage_of(transport, seen)
    about = OUTLINE_COVERAGE * (coverage_of(transport, grown) > LEAST_COVERAGE)
    coverage = np.maximum(inside, about)
    pixels = np.flatnonzero(grown)
    centres = centre(transport.correspondence, projector)[pixels]
    around = centres[:, None] + kernel_offsets()
    on = on_projector(around, transport)
    held = np.where(on[..., None], around, 0)
    q = transport.correspondence.reshape(-1, 2)[pixels].astype(np.float64)
    weights = direct_weights(np.clip(q, 0, np.array(projector) - 1), centres)[:, 0]
    return Body(
        camera=transport.camera,
        pixels=pixels,
        inner=seen.ravel()[pixels],
        coverage=coverage,
        covered=coverage[held[..., 0], held[..., 1]] * on,
        weights=np.asarray(weights),
        frequency=waves.frequency,
        at_offsets=waves.at(kernel_offsets()),
        to_direct=np.asarray(weights @ waves.at(window_offsets(3))),
        responses=responses_about_q(transport, pixels, waves),
        reach=finer,
    )
