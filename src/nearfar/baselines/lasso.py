"""l1-regularised least squares for many rows that share one matrix.

Each row i minimises over its coefficients x

    1/2 |b - x A|^2 + lambda |x|_1.

Only a few coefficients differ from 0, so a row works on few columns at a time: those in use and
those whose overlap with the residual exceeds lambda, which are looked for among all columns, for
a block of rows in one matrix product. A row has converged once its duality gap over all columns is
small.

Index convention: i runs over rows, n over the N columns of the problem, k over the K responses.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, Integers, blocks
from nearfar.baselines.working_sets import relative_gap, solve_small

# Duality gap at which a row has converged, as a share of its objective: at the wanted lambda, and
# at the larger ones before it.
GAP_TOLERANCE = 1e-3
ROUGH_GAP_TOLERANCE = 1e-2
# Each lambda on the way down, as a share of the one before.
PENALTY_RATIO = 0.3
# A working set is solved to this share of the tolerance, ...
INNER_TOLERANCE_SHARE = 0.3
# ... or to this share of the row's present gap, whichever is larger.
INNER_GAP_SHARE = 0.3
MAXIMUM_ROUNDS = 20
# A row may add as many columns at once as it uses, or this many if it uses fewer.
MINIMUM_NEW_COLUMNS = 16
# Rows whose working sets differ in size by no more than this factor are solved together.
MAXIMUM_SIZE_RATIO = 1.4
# Entries of the matrices that are solved at once.
ENTRIES_AT_ONCE = 2**24


class Rows(NamedTuple):
    """Coefficients of the rows so far, and their residuals.

    Attributes
    ----------
    coefficients : ndarray, shape (I, N + 1), float32
        x; the last belongs to no column and is 0.
    residual : ndarray, shape (I, K), float32
        b - x A.
    overlap : ndarray, shape (I, N + 1), float32
        Of each column with the residual.
    """

    coefficients: Floats
    residual: Floats
    overlap: Floats


def start(columns: Floats, responses: Floats) -> Rows:
    """Return rows whose coefficients are all 0.

    Parameters
    ----------
    columns : ndarray, shape (N + 1, K), float32
        A, and a last row of zeros.
    responses : ndarray, shape (I, K), float32
        b.
    """
    nothing = np.zeros((len(responses), len(columns)), dtype=np.float32)
    residual = responses.astype(np.float32, copy=True)
    return Rows(nothing, residual, residual @ columns.T)


def highest_penalty(rows: Rows) -> Floats:
    """Return the least lambda at which the rows of `start` stay 0, shape (I,)."""
    return np.asarray(np.abs(rows.overlap).max(axis=1, initial=0.0))


def solve(
    columns: Floats, responses: Floats, penalty: Floats, tolerance: float = GAP_TOLERANCE
) -> Floats:
    """Minimise at one lambda per row, after a sequence of larger ones.

    Parameters
    ----------
    columns, responses
        As `start`.
    penalty : ndarray, shape (I,)
        lambda; 0 only where the responses are 0.
    tolerance : float
        Duality gap at which a row has converged, as a share of its objective.

    Returns
    -------
    ndarray, shape (I, N + 1), float32
        x, and a 0 for the row of zeros.
    """
    rows = start(columns, responses)
    everything = np.arange(len(responses))
    before = PENALTY_RATIO * highest_penalty(rows)
    while (before > penalty).any():
        settle(
            columns, responses, rows, np.maximum(before, penalty), everything, ROUGH_GAP_TOLERANCE
        )
        before = PENALTY_RATIO * before
    settle(columns, responses, rows, penalty, everything, tolerance)
    return rows.coefficients


def refit(columns: Floats, responses: Floats, coefficients: Floats, most: int) -> Floats:
    """Fit the coefficients that are not 0 by least squares, where there are at most `most`.

    The l1 norm shrinks every coefficient towards 0; the refit undoes this.

    Parameters
    ----------
    columns, responses
        As `start`.
    coefficients : ndarray, shape (I, N + 1)

    Returns
    -------
    ndarray, shape (I, N + 1), float32
    """
    used = coefficients != 0
    counts = used.sum(axis=1)
    found = coefficients.copy()
    for group in _groups(np.where(counts <= most, counts, 0), columns.shape[1]):
        # Unused places point at the column of zeros.
        places = _first_places(np.where(used[group], np.inf, 0.0), counts[group])
        chosen = columns[places].astype(np.float64)
        matrix = chosen @ chosen.transpose(0, 2, 1)
        diagonal = np.arange(places.shape[1])
        # A ridge no larger than rounding, for columns that depend on each other.
        matrix[:, diagonal, diagonal] *= 1.0 + 1e-9
        matrix[:, diagonal, diagonal] += places == len(columns) - 1
        right = chosen @ responses[group].astype(np.float64)[..., None]
        values = np.linalg.solve(matrix, right)[..., 0].astype(np.float32)
        fitted = np.zeros((len(group), len(columns)), dtype=np.float32)
        np.put_along_axis(fitted, places, values, axis=1)
        found[group] = fitted
    return found


def settle(
    columns: Floats,
    responses: Floats,
    rows: Rows,
    penalty: Floats,
    chosen: Integers,
    tolerance: float = GAP_TOLERANCE,
) -> None:
    """Bring chosen rows to their minimum at lambda = `penalty`, in place.

    Parameters
    ----------
    columns, responses
        As `start`.
    rows : Rows
        The start, best the minimum at a lambda a few times as large.
    penalty : ndarray, shape (I,)
        lambda of every row, chosen or not.
    chosen : ndarray of int
    tolerance : float
        Duality gap at which a row has converged, as a share of its objective. After
        `MAXIMUM_ROUNDS` rounds a row is left as it is.
    """
    penalty = penalty.astype(np.float32)
    active = chosen
    for _ in range(MAXIMUM_ROUNDS):
        energy = np.einsum("ik,ik->i", rows.residual[active], rows.residual[active])
        gap = relative_gap(rows.coefficients[active], rows.overlap[active], energy, penalty[active])
        active, gap = active[gap > tolerance], gap[gap > tolerance]
        if not len(active):
            return
        wanted = np.maximum(INNER_TOLERANCE_SHARE * tolerance, INNER_GAP_SHARE * gap)
        _one_round(columns, rows, active, penalty, wanted)
        residual = responses[active] - rows.coefficients[active] @ columns
        rows.residual[active] = residual
        rows.overlap[active] = residual @ columns.T


def _one_round(
    columns: Floats, rows: Rows, active: Integers, penalty: Floats, tolerance: Floats
) -> None:
    """Solve each active row on its working set, and update its coefficients only."""
    used = rows.coefficients[active] != 0
    steep = np.abs(rows.overlap[active])
    steep[steep <= penalty[active, None]] = 0.0
    in_use = used.sum(axis=1)
    steep[used] = np.inf
    wanted = np.count_nonzero(steep, axis=1) - in_use
    sizes = in_use + np.minimum(wanted, np.maximum(MINIMUM_NEW_COLUMNS, in_use))
    for group in _groups(sizes, columns.shape[1]):
        i = active[group]
        places = _first_places(steep[group], sizes[group])
        chosen = columns[places]
        gram = chosen @ chosen.transpose(0, 2, 1)
        diagonal = np.arange(places.shape[1])
        gram[:, diagonal, diagonal] += places == len(columns) - 1
        entries = solve_small(
            np.ascontiguousarray(gram.transpose(1, 0, 2)),
            np.take_along_axis(rows.coefficients[i], places, axis=1),
            np.take_along_axis(rows.overlap[i], places, axis=1),
            penalty[i],
            np.einsum("ik,ik->i", rows.residual[i], rows.residual[i]),
            tolerance[group],
        )
        fresh = np.zeros((len(i), len(columns)), dtype=np.float32)
        np.put_along_axis(fresh, places, entries, axis=1)
        rows.coefficients[i] = fresh


def _groups(sizes: Integers, responses: int) -> Iterator[Integers]:
    """Cut rows into groups of like sizes whose matrices fit in memory; size 0 is left out."""
    order = np.argsort(sizes, kind="stable")
    order = order[sizes[order] > 0]
    while len(order):
        alike = order[
            : np.searchsorted(
                sizes[order],
                MAXIMUM_SIZE_RATIO * max(sizes[order[0]], MINIMUM_NEW_COLUMNS),
                "right",
            )
        ]
        largest = int(sizes[alike[-1]])
        for block in blocks(
            len(alike), max(1, ENTRIES_AT_ONCE // (largest * (2 * largest + responses)))
        ):
            yield alike[block]
        order = order[len(alike) :]


def _first_places(scores: Floats, sizes: Integers) -> Integers:
    """List the `sizes` places of highest score in each row, filled up with the last place."""
    largest = int(sizes.max())
    places = np.argpartition(-scores, largest - 1, axis=1)[:, :largest]
    order = np.argsort(-np.take_along_axis(scores, places, axis=1), axis=1)
    places = np.take_along_axis(places, order, axis=1)
    places[np.arange(largest) >= sizes[:, None]] = scores.shape[1] - 1
    return np.asarray(places)
