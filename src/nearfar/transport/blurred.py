"""Pictures, adjoint and rows of d and n where near-range light is made of hats of several pixels.

Index convention: c runs over camera pixels, i over channels, l over lights, w over functions;
lights are (L, 1, P) for all channels, or (L, channels, P); pictures are (L, C, channels).
"""

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, blocks
from nearfar.parallel import side_by_side
from nearfar.transport.boxes import spread_summed_area, summed_area
from nearfar.transport.direct import Footprint, look_up
from nearfar.transport.pyramid import Pyramid

# Camera pixels of a batch.
BATCH_PIXELS = 2048


def blurred_pictures(
    direct: Floats,
    near: Floats,
    pyramid: Pyramid,
    centres: NDArray[np.int64],
    where: Footprint,
    lights: Floats,
) -> tuple[Floats, Floats]:
    """Return the pictures of d and of n.

    Parameters
    ----------
    direct : ndarray, shape (C, channels)
    near : ndarray, shape (C, channels, J)
    pyramid : Pyramid
    centres : ndarray of int, shape (C, 2)
        q rounded.
    where : Footprint
        What `nearfar.transport.boxes.box_places` gives.
    lights : ndarray
    """
    shape = (len(lights), *direct.shape)
    dtype = np.result_type(lights, near)
    of_direct, of_near = np.empty(shape, dtype=dtype), np.empty(shape, dtype=dtype)
    places = pyramid.places(centres)
    for number, light in enumerate(lights):
        squares = [own.reshape(pyramid.projector) for own in light]
        levels = [pyramid.levels(own) for own in squares]
        summed = [summed_area(own) for own in squares]

        def work(
            batch: slice,
            number: int = number,
            levels: list[Floats] = levels,
            summed: list[Floats] = summed,
        ) -> None:
            here = Footprint(where.pixels[batch], where.weights[batch])
            entries = places[batch, None] + pyramid.steps
            for i in range(shape[2]):
                own = i if len(levels) > 1 else 0
                if i == 0 or len(levels) > 1:
                    at_q, seen = look_up(summed[own], here), levels[own][entries]
                of_direct[number, batch, i] = direct[batch, i] * at_q
                np.einsum("cw,cw->c", near[batch, i], seen, out=of_near[number, batch, i])

        side_by_side(work, blocks(shape[1], BATCH_PIXELS))
    return of_direct, of_near


def blurred_adjoint(
    direct: Floats,
    near: Floats,
    pyramid: Pyramid,
    centres: NDArray[np.int64],
    where: Footprint,
) -> Floats:
    """Scatter d (n,) and n (n, J) of some camera pixels over the projector, (Py, Px)."""
    height, width = pyramid.projector
    table = np.bincount(
        where.pixels.ravel(),
        weights=(where.weights * direct[:, None]).ravel(),
        minlength=(height + 1) * (width + 1),
    )
    spread = np.zeros(int(np.prod(pyramid.shape)))
    places = pyramid.places(centres)
    for batch in blocks(len(near), BATCH_PIXELS):
        entries = places[batch, None] + pyramid.steps
        # Only the rows between the first and the last place are touched.
        first = int(entries.min())
        some = np.bincount((entries - first).ravel(), weights=near[batch].ravel())
        spread[first : first + len(some)] += some
    back: Floats = pyramid.spread(spread)
    back += spread_summed_area(table, pyramid.projector)
    return back


def blurred_rows(
    direct: Floats,
    near: Floats,
    pyramid: Pyramid,
    centres: NDArray[np.int64],
    where: Footprint,
) -> tuple[Floats, Floats]:
    """Return dense rows of D and of N of some camera pixels, each (n, channels, P), float32.

    Parameters
    ----------
    direct, near, pyramid, centres, where
        As `blurred_pictures` takes them, of these camera pixels.
    """
    d, n = (np.zeros((*direct.shape, pyramid.projector.pixels), dtype=np.float32) for _ in range(2))
    for c, i in np.ndindex(direct.shape):
        one = slice(c, c + 1)
        its = Footprint(where.pixels[one], where.weights[one])
        for rows, own_direct, own_near in (
            (d, direct[one, i], np.zeros_like(near[one, i])),
            (n, np.zeros_like(direct[one, i]), near[one, i]),
        ):
            rows[c, i] = blurred_adjoint(own_direct, own_near, pyramid, centres[one], its).ravel()
    return d, n
