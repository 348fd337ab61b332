"""Search from coarse to fine: low frequencies over the whole projector, higher ones near by.

A level takes the frequencies up to some number of cycles across the projector, and scores places
less than a third of their shortest period apart: the first all over the projector, each later one
in a window about the candidates of the level before. Several candidates are kept where their scores
differ by no more than may be missed between two scored places.

Index convention: n runs over camera pixels, m over candidates, o over the places of a window.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Integers, blocks
from nearfar.correspondence.footprints import filters, kept, widths
from nearfar.correspondence.weighing import Weighed
from nearfar.illumination.real_basis import RealBasis

# Cycles across the projector up to which frequencies find the first candidates.
FIRST_CYCLES = 8.0
# Highest frequency of each level over that of the level before.
LEVEL_RATIO = 3.0
# Scored places in the shortest period of a level.
PLACES_PER_PERIOD = 3.5
# Reach of a window to each side, in steps of the level before: half a step is its rounding, the
# rest what near- and far-range light pull.
WINDOW_REACH = 0.75
# One in so many widths of footprints is tried while searching.
WIDTHS_STEP = 2
# Share of the score of new frequencies that may be missed between scored places, and deviations
# that noise may take: candidates that score lower are dropped.
MISSED_SHARE = 0.4
MISSED_DEVIATIONS = 3.0
MOST_CANDIDATES = 8
# Values of scores that are in memory at once.
SCORES_AT_ONCE = 2**21


class Level(NamedTuple):
    """A level of the search.

    Attributes
    ----------
    basis : RealBasis
        The frequencies of all levels.
    frequencies : int
        How many of them, the first ones, are this level's.
    down, across : ndarray of int64
        Rows and columns of the window, of O places together, from a candidate in projector pixels;
        at the first level from (0, 0).
    filters : ndarray, shape (R, S * O), float32
        Matched filters of footprints of S widths.
    power : ndarray, shape (K, S), float32
        Squared share of each response that the footprints keep.
    """

    basis: RealBasis
    frequencies: int
    down: Integers
    across: Integers
    filters: Floats
    power: Floats


class Candidates(NamedTuple):
    """Places where the direct light of camera pixels may come from.

    Attributes
    ----------
    pixel : ndarray, shape (m,), int64
        Camera pixel of each, ascending.
    place : ndarray, shape (m, 2), int64
        Projector pixel.
    score : ndarray, shape (m,), float32
        Matched filter in units of its deviation.
    """

    pixel: NDArray[np.int64]
    place: NDArray[np.int64]
    score: Floats

    def some(self, chosen: slice | Integers | Booleans) -> "Candidates":
        """Return some of them."""
        return Candidates(self.pixel[chosen], self.place[chosen], self.score[chosen])


def by_cycles(basis: RealBasis) -> RealBasis:
    """Return the same frequencies in ascending order of their cycles across the projector."""
    order = np.argsort(_cycles_across(basis).max(axis=1), kind="stable")
    return RealBasis(tuple(basis.frequencies[i] for i in order), basis.projector)


def _cycles_across(basis: RealBasis) -> Floats:
    return np.abs(basis.cycles * basis.projector)


def build_levels(basis: RealBasis) -> tuple[Level, ...]:
    """Return the levels of a search.

    Parameters
    ----------
    basis : RealBasis
        Frequencies in the order of `by_cycles`, without DC.
    """
    projector = np.array(basis.projector)
    cycles = _cycles_across(basis).max(axis=1)
    levels: list[Level] = []
    before = projector
    for highest in _cutoffs(cycles):
        step = np.maximum(projector / (PLACES_PER_PERIOD * highest), 1.0)
        if levels:
            reach = np.ceil(WINDOW_REACH * before / step)
            axes = [np.rint(np.arange(-r, r + 1) * s) for r, s in zip(reach, step, strict=True)]
            footprints = widths(basis.projector)[::WIDTHS_STEP]
        else:
            number = np.ceil((projector - 1) / step).astype(int) + 1
            axes = [
                np.rint(np.linspace(0, side - 1, n))
                for side, n in zip(projector, number, strict=True)
            ]
            # The widths of footprints hardly matter to the lowest frequencies.
            footprints = np.zeros(1)
        count = int(np.searchsorted(cycles, highest, side="right"))
        mine = RealBasis(basis.frequencies[:count], basis.projector)
        offsets = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
        shares = kept(mine, footprints)
        down, across = (axis.astype(np.int64) for axis in axes)
        levels.append(Level(basis, count, down, across, filters(mine, offsets, shares), shares**2))
        before = step
    return tuple(levels)


def _cutoffs(cycles: Floats) -> list[float]:
    """Return the highest cycles of each level, from those of all frequencies, ascending.

    Where there are no frequencies between two, places alone get closer to each other.
    """
    cutoffs = [max(FIRST_CYCLES, float(cycles[0]))]
    while cutoffs[-1] < cycles[-1]:
        cutoffs.append(min(LEVEL_RATIO * cutoffs[-1], float(cycles[-1])))
    return cutoffs


def search(levels: tuple[Level, ...], weighed: Weighed) -> Candidates:
    """Return candidates of every camera pixel, one or more of each."""
    pixels = len(weighed.responses)
    anywhere = Candidates(
        np.arange(pixels), np.zeros((pixels, 2), dtype=np.int64), np.zeros(pixels, dtype=np.float32)
    )
    first = _narrow(levels[0], None, weighed, anywhere)
    return search_near(levels, weighed, first, 1)


def search_near(
    levels: tuple[Level, ...], weighed: Weighed, candidates: Candidates, first: int
) -> Candidates:
    """Follow candidates from a level on."""
    for before, level in zip(levels[first - 1 :], levels[first:], strict=False):
        candidates = _narrow(level, before, weighed, candidates)
    return candidates


def _narrow(
    level: Level, before: Level | None, weighed: Weighed, candidates: Candidates
) -> Candidates:
    """Return the local maxima in the windows of candidates that are not much too low."""
    size = level.filters.shape[1]
    parts = [
        _local_maxima(level, weighed, candidates.some(block))
        for block in blocks(len(candidates.pixel), max(1, SCORES_AT_ONCE // size))
    ]
    found = Candidates(
        np.concatenate([part.pixel for part in parts]),
        np.concatenate([part.place for part in parts]),
        np.concatenate([part.score for part in parts]),
    )
    known = 0 if before is None else before.frequencies
    weights = weighed.weights[:, : level.frequencies]
    new_share = weights[:, known:].sum(axis=1) / weights.sum(axis=1)
    return _best(found, new_share)


def _local_maxima(level: Level, weighed: Weighed, candidates: Candidates) -> Candidates:
    # Numba takes a while to load, and plans are made with this module, without a search.
    from nearfar.correspondence.maxima import local_maxima

    pixel = candidates.pixel
    centred = level.basis.recentre(weighed.responses[pixel, None], candidates.place)[:, 0]
    deviations = np.sqrt(weighed.weights[pixel, : level.frequencies] @ level.power)
    scores = centred[:, : len(level.filters)] @ level.filters
    shape = (len(pixel), -1, len(level.down), len(level.across))
    which, place, score = local_maxima(
        scores.reshape(shape),
        deviations,
        candidates.place,
        level.down,
        level.across,
        np.array(level.basis.projector),
        (MISSED_SHARE, MISSED_DEVIATIONS),
    )
    return Candidates(pixel[which], place, score)


def _best(found: Candidates, new_share: Floats) -> Candidates:
    """Keep the candidates that are not much lower than the highest of their camera pixel."""
    found = found.some(
        np.lexsort((found.place[:, 1], found.place[:, 0], -found.score, found.pixel))
    )
    pixel, place, score = found
    first = np.flatnonzero(np.diff(pixel, prepend=-1))
    number = np.diff(np.append(first, len(pixel)))
    rank = np.arange(len(pixel)) - np.repeat(first, number)
    highest = np.repeat(score[first], number)
    least = highest - MISSED_SHARE * new_share[pixel] * np.abs(highest) - MISSED_DEVIATIONS
    # The same place, found in two windows, has the same score.
    again = (rank > 0) & np.all(np.diff(place, axis=0, prepend=-1) == 0, axis=1)
    keep = (rank == 0) | ((rank < MOST_CANDIDATES) & (score >= least) & ~again)
    return found.some(keep)
