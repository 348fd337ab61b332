"""Small lasso problems, each row with columns of its own, by coordinate descent and Newton steps.

Each row i minimises over x, given the columns that it works on,

    1/2 |b - x A|^2 + lambda |x|_1,

from their Gram matrix alone. Sweeps of coordinate descent (Friedman et al. 2007) run over all rows
at once; where a row converges slowly, its equations on the nonzero entries are solved, and x moves
towards that solution up to the first entry that would change its sign. Neither step raises the
objective. A row stops once its duality gap is small.

Index convention: i runs over rows, j and l over places in a row's working set.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Floats

# Sweeps between two checks of the gap, the most checks, and the checks before Newton steps begin.
SWEEPS_PER_CHECK = 4
MAXIMUM_CHECKS = 30
CHECKS_BEFORE_NEWTON = 1
# Keeps the Newton equations solvable where columns of the working set depend on each other.
RELATIVE_RIDGE = 1e-6
DIVISOR_FLOOR = 1e-30


class Small(NamedTuple):
    """Lasso problems of the rows that have not converged.

    Attributes
    ----------
    gram : ndarray, shape (J, I, J), float32
        Overlap of columns j and l of row i at [j, i, l]; 1 on the diagonal of a place unused.
    entries : ndarray, shape (I, J), float32
        x; changed in place.
    slopes : ndarray, shape (I, J), float32
        Overlap of each column with the residual; changed in place.
    penalty : ndarray, shape (I,), float32
        lambda.
    energy : ndarray, shape (I,), float32
        |residual|^2 at the start.
    first_entries, first_slopes : ndarray, shape (I, J), float32
        As they were at the start.
    """

    gram: Floats
    entries: Floats
    slopes: Floats
    penalty: Floats
    energy: Floats
    first_entries: Floats
    first_slopes: Floats

    def only(self, rows: Booleans) -> "Small":
        """Return some of the rows."""
        rest = (values[rows] for values in self[1:])
        return Small(np.ascontiguousarray(self.gram[:, rows]), *rest)


def solve_small(
    gram: Floats,
    entries: Floats,
    slopes: Floats,
    penalty: Floats,
    energy: Floats,
    tolerance: Floats,
) -> Floats:
    """Minimise each row's lasso on its working set.

    Parameters
    ----------
    gram : ndarray, shape (J, I, J), float32
    entries, slopes : ndarray, shape (I, J), float32
        Where to start, and the overlap of each column with the residual there.
    penalty, energy : ndarray, shape (I,), float32
        lambda, and |residual|^2 at the start.
    tolerance : ndarray, shape (I,)
        Duality gap at which a row stops, as a share of its objective.

    Returns
    -------
    ndarray, shape (I, J), float32
        x. A row that has not converged after `MAXIMUM_CHECKS` checks is returned as it is.
    """
    found = entries.copy()
    rows = np.arange(len(entries))
    small = Small(gram, entries.copy(), slopes.copy(), penalty, energy, entries, slopes)
    for check in range(MAXIMUM_CHECKS):
        _sweep(small)
        going = ~_settled(small, tolerance[rows])
        found[rows] = small.entries
        if not going.any():
            break
        # Leaving rows out copies the Gram matrices, so this waits until enough rows have converged.
        if going.mean() < 0.7:
            rows, small = rows[going], small.only(going)
        if check >= CHECKS_BEFORE_NEWTON:
            _newton(small)
    return found


def relative_gap(entries: Floats, slopes: Floats, energy: Floats, penalty: Floats) -> Floats:
    """Return the duality gap of each row as a share of its objective, (I,).

    Parameters
    ----------
    entries, slopes : ndarray, shape (I, J)
        x, and the overlap of every column with the residual.
    energy, penalty : ndarray, shape (I,)
        |residual|^2 and lambda.
    """
    steepest = np.maximum(np.abs(slopes).max(axis=1, initial=0.0), DIVISOR_FLOOR)
    # The residual, scaled until no column overlaps it by more than lambda, is dual feasible.
    scale = np.minimum(1.0, penalty / steepest)
    size = penalty * np.abs(entries).sum(axis=1)
    # As b = residual + x A, no large numbers are subtracted here.
    gap = 0.5 * (1 - scale) ** 2 * energy + size
    gap -= scale * np.einsum("ij,ij->i", entries, slopes)
    return np.asarray(gap / np.maximum(0.5 * energy + size, DIVISOR_FLOOR))


def _settled(small: Small, tolerance: Floats) -> Booleans:
    moved = small.entries - small.first_entries
    middle = small.slopes + small.first_slopes
    energy = small.energy - np.einsum("ij,ij->i", moved, middle)
    gap = relative_gap(small.entries, small.slopes, np.maximum(energy, 0.0), small.penalty)
    return np.asarray(gap <= tolerance)


def _sweep(small: Small) -> None:
    """Minimise over each entry in turn, all rows at once, in a few sweeps."""
    gram, x, slopes, penalty = small[:4]
    squared = np.einsum("jij->ji", gram).copy()
    for _ in range(SWEEPS_PER_CHECK):
        for j in range(len(gram)):
            partial = slopes[:, j] + squared[j] * x[:, j]
            there = (partial - np.minimum(np.maximum(partial, -penalty), penalty)) / squared[j]
            step = there - x[:, j]
            if np.count_nonzero(step):
                x[:, j] = there
                slopes -= step[:, None] * gram[j]


def _newton(small: Small) -> None:
    """Move to the minimum for the present signs, or to the first change of a sign on the way."""
    x, slopes, penalty = small.entries, small.slopes, small.penalty
    used = x != 0
    most = int(used.sum(axis=1).max(initial=0))
    if most == 0:
        return
    row = np.arange(len(x))
    place = np.argsort(~used, axis=1, kind="stable")[:, :most]
    kept = np.take_along_axis(used, place, axis=1)
    here = np.take_along_axis(x, place, axis=1)
    matrix = small.gram[place[:, :, None], row[:, None, None], place[:, None, :]]
    matrix *= kept[:, :, None] & kept[:, None, :]
    matrix[:, np.arange(most), np.arange(most)] += np.where(kept, RELATIVE_RIDGE, 1.0).astype(
        x.dtype
    )
    descent = np.take_along_axis(slopes, place, axis=1) - penalty[:, None] * np.sign(here)
    step = np.linalg.solve(matrix, np.where(kept, descent, 0)[..., None])[..., 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        until = np.where(kept & (step * here < 0), -here / step, np.inf)
    first = until.argmin(axis=1)
    reach = until[row, first]
    step *= np.minimum(1.0, reach)[:, None]
    there = here + step
    crossed = reach <= 1.0
    there[row[crossed], first[crossed]] = 0.0
    # The slopes follow the step that was really taken, rounding included.
    walked = np.zeros_like(x)
    np.put_along_axis(walked, place, there - here, axis=1)
    np.put_along_axis(x, place, there, axis=1)
    slopes -= np.einsum("ji,jil->il", walked.T, small.gram, optimize=False)
