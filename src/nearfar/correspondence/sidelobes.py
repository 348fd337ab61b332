"""Camera pixels that are mistaken for lit by a place between two that do light them.

From few frequencies the score of a single place has sidelobes. Where a camera pixel sees two
surfaces, as at a depth edge, sidelobes of both may add up to more than either place scores. The
neighbours on either side see one surface each. So where q is other than several neighbours expect,
direct light from q's own place is compared with direct light from their places together. A sidelobe
explains nothing that these do not explain; a thin thing or an edge needs its own place.

Index convention: c runs over camera pixels, m over suggested places, o over projector pixels about
q and these places, r over real responses.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Integers, blocks
from nearfar.correspondence.background import SEARCH_BACKGROUND
from nearfar.correspondence.neighbours import SIDES, agree, continued, differ
from nearfar.correspondence.nonnegative import nonnegative_entries
from nearfar.correspondence.weighing import Division, weigh

# Neighbours that expect another place for q to be doubted: at a straight edge it is one.
LEAST_OTHERS = 2
# q is a sidelobe where leaving its own place out costs at most this share of what leaving the
# neighbours' places out costs. On the box seen from aside and 29 photos sidelobes have at most
# 0.03, all else at least 0.4.
LARGEST_SHARE = 0.1
# Where so many neighbours expect one and the same place, it need only explain more.
MOST_NEIGHBOURS = 3
# Pixels on each side of a place from which direct light may come.
PLACE_REACH = 1
# Camera pixels at once.
PIXELS_AT_ONCE = 256


class Replaced(NamedTuple):
    """Camera pixels whose q was a sidelobe.

    Attributes
    ----------
    pixels : ndarray of int, shape (n,)
    places : ndarray, shape (n, 2)
        Where neighbours expect the direct light, the brightest of their places.
    """

    pixels: Integers
    places: NDArray[np.float64]


def replace_sidelobes(division: Division, q: Floats, lit: Booleans) -> Replaced:
    """Find camera pixels whose q is a sidelobe, and where their light comes from instead.

    Parameters
    ----------
    division : Division
        Of the measured frequencies.
    q : ndarray, shape (Cy, Cx, 2)
        Found at each camera pixel by itself.
    lit : ndarray of bool, shape (Cy, Cx)
        Where there is direct light.
    """
    suggested, tolerances = continued(np.where(lit[..., None], q, np.nan))
    suggested = suggested.reshape(len(SIDES), -1, 2)
    flat = q.reshape(-1, 2)
    tolerances = tolerances.reshape(len(SIDES), -1)
    other = differ(flat, suggested, tolerances)
    (asking,) = np.nonzero((other.sum(axis=0) >= LEAST_OTHERS) & lit.ravel())
    places = np.where(other[..., None], suggested, np.nan)
    pixels, found = [asking[:0]], [np.empty((0, 2))]
    for block in blocks(len(asking), PIXELS_AT_ONCE):
        some = asking[block]
        explained, brightest = _explain(division, some, flat[some], places[:, some])
        own, beside, together = explained
        place = places[brightest, some]
        expecting = agree(place, places[:, some], tolerances[:, some]).sum(axis=0)
        sidelobe = together - beside <= LARGEST_SHARE * (together - own)
        taken = (beside > own) & (sidelobe | (expecting >= MOST_NEIGHBOURS))
        pixels.append(some[taken])
        found.append(place[taken])
    return Replaced(np.concatenate(pixels), np.concatenate(found))


def _explain(
    division: Division, pixels: Integers, own: Floats, places: Floats
) -> tuple[Floats, Integers]:
    """Fit direct light about q, about suggested places, and about both.

    Parameters
    ----------
    division : Division
    pixels : ndarray of int, shape (n,)
    own : ndarray, shape (n, 2)
        q.
    places : ndarray, shape (4, n, 2)
        Suggested places; NaN where there is none.

    Returns
    -------
    explained : ndarray, shape (3, n)
        What each of the three explains of the weighted sum of squares.
    brightest : ndarray of int, shape (n,)
        The suggested place about which direct light alone is brightest.
    """
    basis = division.basis
    weighed = weigh(basis, division.of_pixels(pixels), SEARCH_BACKGROUND)
    side = np.arange(-PLACE_REACH, PLACE_REACH + 1)
    square = np.stack(np.meshgrid(side, side, indexing="ij"), axis=-1).reshape(-1, 2)
    middles = np.concatenate([own[None], places]).swapaxes(0, 1)
    squares = np.rint(middles)[:, :, None] + square
    # NaN is not on the grid.
    with np.errstate(invalid="ignore"):
        on_grid = np.all((squares >= 0) & (squares < basis.projector), axis=-1)
    entries = np.where(on_grid[..., None], squares, 0).reshape(len(pixels), -1, 2).astype(np.int64)
    inside = on_grid.reshape(len(pixels), -1) & ~_is_repeated(entries, on_grid)
    patterns = basis.patterns_at(entries.reshape(-1, 2)).reshape(basis.count, *entries.shape[:2])
    patterns = np.ascontiguousarray(patterns.transpose(1, 2, 0))
    weighted = patterns * weighed.weights[:, None, basis.index]
    gram = np.ascontiguousarray((weighted @ patterns.swapaxes(1, 2)).transpose(1, 2, 0))
    scores = np.ascontiguousarray(np.einsum("cor,cr->oc", patterns, weighed.responses))
    is_own = np.arange(entries.shape[1]) < len(square)
    no_ridge = np.zeros(entries.shape[1], dtype=np.float32)
    (_, alone), (light, beside), (_, together) = (
        nonnegative_entries(scores, gram, (inside & chosen).T, no_ridge)
        for chosen in (is_own, ~is_own, True)
    )
    # The descent over all entries may not have come as far as that over a part of them.
    together = np.maximum(together, np.maximum(alone, beside))
    brightness = np.where(inside, light.T, 0.0).reshape(on_grid.shape).sum(axis=2)
    return np.stack([alone, beside, together]), brightness[:, 1:].argmax(axis=1)


def _is_repeated(entries: NDArray[np.int64], on_grid: Booleans) -> Booleans:
    """Return which projector pixels are among those before them, (n, O)."""
    same = np.all(entries[:, :, None] == entries[:, None], axis=-1)
    before = np.tri(entries.shape[1], k=-1, dtype=bool)
    return np.asarray((same & before & on_grid.reshape(len(entries), 1, -1)).any(axis=2))
