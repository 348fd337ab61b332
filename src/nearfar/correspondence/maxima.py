"""Local maxima of scores in windows about candidates, one compiled pass over each window.

Index convention: m runs over candidates, s over widths of footprints, o over the places of a
window, rows by columns, i over maxima.
"""

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Integers
from nearfar.compiled import compiled


def local_maxima(
    scores: Floats,
    deviations: Floats,
    places: Integers,
    down: Integers,
    across: Integers,
    projector: Integers,
    missed: tuple[float, float],
) -> tuple[NDArray[np.int64], NDArray[np.int64], Floats]:
    """Return the places that score no lower than their neighbours, and not much too low.

    Parameters
    ----------
    scores : ndarray, shape (m, s, rows, columns), float32
    deviations : ndarray, shape (m, s), float32
        Scores are divided by them; the highest s counts.
    places : ndarray, shape (m, 2), int64
        Projector pixel of each candidate.
    down, across : ndarray of int64
        Rows and columns of the window from a candidate. Beyond the projector's border whole cycles
        begin again, so places there do not count.
    projector : ndarray, shape (2,), int64
        Height and width.
    missed : tuple of float
        Share of the highest score of a window, and deviations, by which maxima may be lower.

    Returns
    -------
    which : ndarray, shape (i,), int64
        The candidate of each maximum, ascending; row by row of its window.
    place : ndarray, shape (i, 2), int64
    score : ndarray, shape (i,), float32
    """
    windows = np.empty((len(scores), *scores.shape[2:]), dtype=scores.dtype)
    counts = _count(scores, deviations, places, down, across, projector, missed, windows)
    starts = np.cumsum(counts) - counts
    which = np.repeat(np.arange(len(scores)), counts)
    place = np.empty((len(which), 2), dtype=np.int64)
    score = np.empty(len(which), dtype=scores.dtype)
    _put(windows, places, down, across, starts, place, score)
    return which, place, score


@compiled
def _count(
    scores: Floats,
    deviations: Floats,
    places: Integers,
    down: Integers,
    across: Integers,
    projector: Integers,
    missed: tuple[float, float],
    windows: Floats,
) -> NDArray[np.int64]:
    """Put into `windows` the scores of maxima, and -inf elsewhere; return how many there are."""
    number, widths, rows, columns = scores.shape
    counts = np.zeros(number, dtype=np.int64)
    none = np.float32(-np.inf)
    flat = scores.reshape((number, widths, rows * columns))
    best = np.empty(rows * columns, dtype=scores.dtype)
    # A border of -inf, so that every place has eight neighbours.
    bordered = np.full((rows + 2, columns + 2), none)
    for m in range(number):
        best[:] = none
        for s in range(widths):
            scale = np.float32(1.0) / deviations[m, s]
            for o in range(rows * columns):
                scaled = flat[m, s, o] * scale
                best[o] = scaled if scaled > best[o] else best[o]
        highest = none
        for row in range(rows):
            inside = 0 <= places[m, 0] + down[row] < projector[0]
            for column in range(columns):
                x = places[m, 1] + across[column]
                score = best[row * columns + column] if inside and 0 <= x < projector[1] else none
                bordered[row + 1, column + 1] = score
                highest = score if score > highest else highest
        least = highest - np.float32(missed[0]) * abs(highest) - np.float32(missed[1])
        for row in range(rows):
            for column in range(columns):
                score = bordered[row + 1, column + 1]
                kept = score >= least
                if kept:
                    for i in range(3):
                        for j in range(3):
                            kept = kept and score >= bordered[row + i, column + j]
                windows[m, row, column] = score if kept else none
                counts[m] += kept
    return counts


@compiled
def _put(
    windows: Floats,
    places: Integers,
    down: Integers,
    across: Integers,
    starts: Integers,
    place: Integers,
    score: Floats,
) -> None:
    """Put the places and the scores of the maxima in `windows` one after another."""
    for m in range(len(windows)):
        at = starts[m]
        for row in range(len(down)):
            for column in range(len(across)):
                if windows[m, row, column] > -np.inf:
                    place[at, 0] = places[m, 0] + down[row]
                    place[at, 1] = places[m, 1] + across[column]
                    score[at] = windows[m, row, column]
                    at += 1
