"""Correspondence by phase on projectors with too many pixels to score every place.

Each camera pixel's place is first searched for by itself, from coarse to fine (`levels`), and its
footprint placed to a fraction of a pixel (`footprints`). Then neighbours tell where else to look
(`neighbours`): where q does not continue that of a lit camera pixel beside, the place that would is
scored too, and taken where it explains the responses better, or as well.

Index convention: c runs over camera pixels, k over frequencies, m over suggested places.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, blocks
from nearfar.correspondence.background import (
    LARGE_DETECTION_BACKGROUND,
    LARGE_FOOTPRINT_BACKGROUND,
    LARGE_SEARCH_BACKGROUND,
)
from nearfar.correspondence.footprints import Footprints
from nearfar.correspondence.levels import (
    Candidates,
    Level,
    build_levels,
    by_cycles,
    search,
    search_near,
)
from nearfar.correspondence.neighbours import (
    REACH,
    SAME_PIXELS,
    SIDES,
    agree,
    continued,
    differ,
)
from nearfar.correspondence.weighing import (
    Division,
    RelativeResponses,
    Weighed,
    division_by_white,
    weigh,
)
from nearfar.illumination.real_basis import RealBasis
from nearfar.parallel import side_by_side
from nearfar.photometry.measurements import Measurements

# Camera pixels at once.
PIXELS_AT_ONCE = 1024
# Excess above which a camera pixel has direct light: a fifteenth of white, where the footprint is
# sharp. It lies between the highest of unlit, 1.0, and the first percentile of lit camera pixels,
# 1.7, of a Cornell box seen from aside under a projector of 256x256.
LEAST_LARGE_EXCESS = 1.5
# How often neighbours are asked: wrong places up to twice as many camera pixels wide are mended.
ROUNDS = 2
# From so few frequencies many places are alike: at 128x128 up to two thirds of the camera pixels
# are wrong at first. Of 9216, from 23 to 27 responses, up to 1246 are wrong after two rounds, 48
# after four and none after six.
FEW_FREQUENCIES, ROUNDS_BY_FEW = 32, 8
# Levels of the search that a suggested place goes through.
LAST_LEVELS = 2
# Where three of the four neighbours expect another place and at most one its own, a camera pixel is
# given the other place if its score there is at least this share of its own.
AMBIGUOUS_SHARE = 0.98


class _Filters(NamedTuple):
    """What depends on the frequencies alone.

    Attributes
    ----------
    basis : RealBasis
        Frequencies in the order of the levels.
    levels : tuple of Level
    footprints : Footprints
    undisturbed : float
        Number of responses that near- and far-range light leave to direct light.
    """

    basis: RealBasis
    levels: tuple[Level, ...]
    footprints: Footprints
    undisturbed: float


class _Found(NamedTuple):
    """What is found of camera pixels.

    Attributes
    ----------
    q : ndarray, shape (C, 2), float32
    score : ndarray, shape (C,), float32
        How far direct light from q stands out among all responses, in deviations.
    excess : ndarray, shape (C,), float32
        The same above all that near-range light may be; see `correspond_coarse_to_fine`.
    """

    q: Floats
    score: Floats
    excess: Floats

    def of_pixels(self, pixels: Integers) -> "_Found":
        """Return what is found of some camera pixels."""
        return _Found(self.q[pixels], self.score[pixels], self.excess[pixels])

    def store(self, pixels: slice | Integers, found: "_Found") -> None:
        """Store what is found of some camera pixels."""
        for values, new in zip(self, found, strict=True):
            values[pixels] = new


def rounds(frequencies: int) -> int:
    """Return how often neighbours are asked, for the number of measured frequencies but DC."""
    return ROUNDS_BY_FEW if frequencies < FEW_FREQUENCIES else ROUNDS


def rows_beside(frequencies: int) -> int:
    """Return the rows of the camera on each side that q depends on, for the same number."""
    return rounds(frequencies) * REACH


def correspond_coarse_to_fine(
    measurements: Measurements, basis: RealBasis
) -> tuple[Floats, Floats]:
    """Find q, and how far direct light stands above the background.

    Parameters
    ----------
    measurements : Measurements
        Of DC and other frequencies.
    basis : RealBasis
        These others, which determine a place.

    Returns
    -------
    q : ndarray, shape (Cy, Cx, 2), float32
    excess : ndarray, shape (Cy, Cx), float32
        Root mean square of what direct light explains, in deviations of the background, over the
        responses that near- and far-range light leave to it.
    """
    camera = measurements.camera
    filters = _filters(basis)
    division = division_by_white(measurements, filters.basis)
    found = _Found(
        np.empty((camera.pixels, 2), dtype=np.float32),
        np.empty(camera.pixels, dtype=np.float32),
        np.empty(camera.pixels, dtype=np.float32),
    )

    def work(block: slice) -> None:
        weighings = _weigh(division.of_pixels(block), filters.basis)
        candidates = search(filters.levels, weighings.to_search)
        found.store(block, _best(filters, weighings, candidates))

    side_by_side(work, blocks(camera.pixels, PIXELS_AT_ONCE))
    for _ in range(rounds(len(basis.frequencies))):
        if not _ask_neighbours(filters, division, found):
            break
    return found.q.reshape(*camera, 2), found.excess.reshape(camera)


@lru_cache(maxsize=2)
def _filters(basis: RealBasis) -> _Filters:
    """Build the filters of the measured frequencies; the last few are cached for other tiles."""
    ordered = by_cycles(basis)
    density = LARGE_DETECTION_BACKGROUND.spectral_density(ordered)[ordered.index]
    return _Filters(
        ordered,
        build_levels(ordered),
        Footprints(ordered),
        float(np.sum(LARGE_DETECTION_BACKGROUND.floor**2 / density)),
    )


class _Weighings(NamedTuple):
    """The same responses weighed against several backgrounds; see `background`."""

    to_search: Weighed
    to_place: Weighed
    to_detect: Weighed


def _weigh(relative: RelativeResponses, basis: RealBasis) -> _Weighings:
    single = relative._replace(variances=relative.variances.astype(np.float32))
    return _Weighings(
        weigh(basis, single, LARGE_SEARCH_BACKGROUND),
        weigh(basis, single, LARGE_FOOTPRINT_BACKGROUND),
        weigh(basis, single, LARGE_DETECTION_BACKGROUND),
    )


def _best(filters: _Filters, weighings: _Weighings, candidates: Candidates) -> _Found:
    """Place the footprint of each candidate, and return the best one of each camera pixel."""
    pixel = candidates.pixel
    to_search, to_place, to_detect = (
        Weighed(weighed.responses[pixel], weighed.weights[pixel]) for weighed in weighings
    )
    q, scores = filters.footprints.place(to_place, [to_search, to_detect], candidates.place)
    score, detected = scores.T
    excess = np.maximum(detected, 0.0) / np.sqrt(filters.undisturbed)
    order = np.lexsort((-score, pixel))
    best = order[np.flatnonzero(np.diff(pixel[order], prepend=-1))]
    return _Found(q, score, excess).of_pixels(best)


def _ask_neighbours(filters: _Filters, division: Division, found: _Found) -> bool:
    """Try the places that continue q of lit neighbours; return whether any explained more."""
    camera = division.measurements.camera
    lit = (found.excess > LEAST_LARGE_EXCESS)[:, None]
    places, tolerances = continued(np.where(lit, found.q, np.nan).reshape(*camera, 2))
    places = places.reshape(len(SIDES), camera.pixels, 2)
    tolerances = tolerances.reshape(len(SIDES), camera.pixels)
    other = differ(found.q, places, tolerances)
    (asking,) = np.nonzero(other.any(axis=0))
    limit = np.array(filters.basis.projector) - 1
    first = max(1, len(filters.levels) - LAST_LEVELS)
    changed = np.zeros(camera.pixels, dtype=bool)

    def work(block: slice) -> None:
        pixels = asking[block]
        number, side = np.nonzero(other[:, pixels].T)
        suggested = np.rint(places[side, pixels[number]]).astype(np.int64)
        candidates = Candidates(
            number, np.clip(suggested, 0, limit), np.zeros(len(number), dtype=np.float32)
        )
        weighings = _weigh(division.of_pixels(pixels), filters.basis)
        candidates = search_near(filters.levels, weighings.to_search, candidates, first)
        best = _best(filters, weighings, candidates)
        mine = found.of_pixels(pixels)
        taken = np.flatnonzero(_is_better(best, mine, places[:, pixels], tolerances[:, pixels]))
        found.store(pixels[taken], best.of_pixels(taken))
        changed[pixels[taken]] = True

    side_by_side(work, blocks(len(asking), PIXELS_AT_ONCE))
    return bool(changed.any())


def _is_better(other: _Found, mine: _Found, places: Floats, tolerances: Floats) -> Booleans:
    """Return where another place is taken instead of one's own, (n,)."""
    apart = np.abs(other.q - mine.q).max(axis=1) > SAME_PIXELS
    expected = agree(other.q, places, tolerances).sum(axis=0) >= 3
    expected &= agree(mine.q, places, tolerances).sum(axis=0) <= 1
    least = np.where(expected, AMBIGUOUS_SHARE, 1.0) * mine.score
    return np.asarray(apart & (other.score > least))
