"""Pictures, adjoint and rows of d and n where near-range light is made of hats of several pixels.

Index convention: c runs over camera pixels, i over channels, w over functions.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Integers, blocks
from nearfar.parallel import side_by_side
from nearfar.transport.boxes import BoxAxes, spread_summed_area, summed_area
from nearfar.transport.pictures import DENSE_SHARE
from nearfar.transport.pyramid import Pyramid, bounds

# Camera pixels of a batch, whose values stay in the processor's cache.
BATCH_PIXELS = 1024
# The same where what they send back is summed: the projector pixels around them are gone through
# once for each batch.
BATCH_PIXELS_BACK = 2**14
# A fixed number, so that a sum does not depend on the number of processors. Each has levels of its
# own.
PARTS_BACK = 2


class BlurredLight(NamedTuple):
    """A light of one channel, summed and blurred for the lookups of camera pixels.

    Attributes
    ----------
    lit : tuple of slice
        Projector rows and columns between the first and the last lit pixel.
    table : ndarray, float64
        Its summed-area table, flat.
    levels : ndarray
        The light blurred by the hat of each pitch, flat; see `Pyramid`.
    """

    lit: tuple[slice, slice]
    table: Floats
    levels: Floats


def blurred_light(light: Floats, pyramid: Pyramid) -> BlurredLight:
    """Sum and blur a light, flat or (Py, Px), for the lookups of camera pixels."""
    square = light.reshape(pyramid.projector)
    return BlurredLight(bounds(square), summed_area(square), pyramid.levels(square))


def blurred_pictures(
    direct: Floats,
    near: Floats,
    pyramid: Pyramid,
    centres: NDArray[np.int64],
    where: BoxAxes,
    light: Sequence[BlurredLight],
) -> tuple[Floats, Floats]:
    """Return the pictures of d and of n under a light, each (C, channels).

    Parameters
    ----------
    direct : ndarray, shape (C, channels)
    near : ndarray, shape (C, channels, J)
    pyramid : Pyramid
    centres : ndarray of int, shape (C, 2)
        q rounded.
    where : BoxAxes
    light : sequence of BlurredLight
        One for all channels, or one for each.
    """
    dtype = np.result_type(light[0].levels, near, np.float32)
    of_direct, of_near = (make(direct.shape, dtype=dtype) for make in (np.empty, np.zeros))
    places = pyramid.places(centres)
    for place, one in enumerate(light):
        own = slice(place, place + 1) if len(light) > 1 else slice(None)
        reached = _reached(one.lit, centres, pyramid)

        def work(
            batch: slice,
            own: slice = own,
            one: BlurredLight = one,
            reached: Booleans | None = reached,
        ) -> None:
            at_q = where.of(batch).means(one.table, pyramid.projector)
            of_direct[batch, own] = direct[batch, own] * at_q[:, None]
            chosen: slice | Integers = batch
            if reached is not None and np.count_nonzero(reached[batch]) < DENSE_SHARE * len(at_q):
                # A small light: what most camera pixels see is dark.
                chosen = batch.start + np.flatnonzero(reached[batch])
            seen = np.take(one.levels, places[chosen, None] + pyramid.steps)
            for i in range(*own.indices(direct.shape[1])):
                of_near[chosen, i] = np.einsum("cw,cw->c", near[chosen, i], seen)

        side_by_side(work, blocks(len(direct), BATCH_PIXELS))
    return of_direct, of_near


def _reached(
    lit: tuple[slice, slice], centres: NDArray[np.int64], pyramid: Pyramid
) -> Booleans | None:
    """Return which camera pixels a light may reach by n, (C,); None if it may reach all."""
    reached: Booleans | None = None
    for side, length, places in zip(lit, pyramid.projector, centres.T, strict=True):
        reach = pyramid.basis.reach
        if side.start > reach or side.stop < length - reach:
            near = (places >= side.start - reach) & (places < side.stop + reach)
            reached = near if reached is None else reached & near
    return reached


def blurred_adjoint(
    direct: Floats,
    near: Floats,
    image: Floats,
    pyramid: Pyramid,
    centres: NDArray[np.int64],
    where: BoxAxes,
) -> Floats:
    """Send an image (C,) back through d (C,) and n (C, J): (Py, Px), float64.

    Parameters
    ----------
    direct, near, image : ndarray
    pyramid, centres, where
        As `blurred_pictures` takes them.
    """
    projector = pyramid.projector
    corners = (projector.height + 1) * (projector.width + 1)
    lit = np.flatnonzero(where.of_rows.any(axis=(0, 2)))
    places = pyramid.places(centres)
    parts = [part for part in np.array_split(lit, PARTS_BACK) if len(part)]
    levels = [np.zeros(int(np.prod(pyramid.shape))) for _ in parts]
    tables = [np.zeros(corners) for _ in parts]

    def work(number: int) -> None:
        for batch in blocks(len(parts[number]), BATCH_PIXELS_BACK):
            some = parts[number][batch]
            weights = np.asarray(image[some], dtype=np.float64)
            pyramid.scatter(near[some], places[some], weights, levels[number])
            here = where.of(some).places(projector)
            shares = here.weights * (direct[some] * weights)[:, None]
            np.add.at(tables[number], here.pixels.ravel(), shares.ravel())

    side_by_side(work, range(len(parts)))
    if not parts:
        return np.zeros(projector)
    for more, table in zip(levels[1:], tables[1:], strict=True):
        levels[0] += more
        tables[0] += table
    return pyramid.spread(levels[0]) + spread_summed_area(tables[0], projector)


def blurred_rows(
    direct: Floats,
    near: Floats,
    pyramid: Pyramid,
    centres: NDArray[np.int64],
    where: BoxAxes,
) -> tuple[Floats, Floats]:
    """Return dense rows of D and of N of some camera pixels, each (n, channels, P), float32.

    Parameters
    ----------
    direct, near, pyramid, centres, where
        As `blurred_pictures` takes them, of these camera pixels.
    """
    projector = pyramid.projector
    d, n = (np.zeros((*direct.shape, *projector), dtype=np.float32) for _ in range(2))
    reach = pyramid.basis.reach
    for c in range(len(direct)):
        around, inside = [], []
        for at, side in zip(centres[c].tolist(), projector, strict=True):
            first, last = max(at - reach, 0), min(at + reach + 1, side)
            inside.append(slice(first, last))
            around.append(slice(first - at + reach, last - at + reach))
        drawn = pyramid.basis.drawn(near[c].astype(np.float64))
        n[c][:, *inside] = drawn[:, *around]
        box, shares = where.shares(c)
        d[c][:, *box] = direct[c][:, None, None] * shares
    return d.reshape(*direct.shape, -1), n.reshape(*direct.shape, -1)
