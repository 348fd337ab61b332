"""The equations of windows that the projector's border clips: entries beyond it are zero.

f and noise together have a diagonal covariance s^2 S + sigma^2 / m = sigma^2 D, so the window can
be solved for by itself: with n = diag(deviation) z, z has the precision

    Lambda = (smooth + diag(independent))^-1 / ratio + diag(deviation) B^T D^-1 B diag(deviation)

over the entries inside, ratio = (s / sigma)^2 and B the patterns over the window. Camera pixels
whose windows are clipped to the same rectangle share one factor of Lambda, if they have the same
prior component and ratio. Prior scales are tried in steps of 2, so ratios are rounded to the
nearest power of 2 without loss.

Index convention: arrays are (n, channels, ...); r runs over real responses, w over window entries
inside; m over pairs of a camera pixel and a channel, k over right sides of a pair.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Integers, Size, beside, fetch, namespace
from nearfar.illumination.centred_basis import CentredBasis
from nearfar.illumination.near_basis import NearBasis, reachable
from nearfar.priors.covariance import CORRELATION_LENGTH, smooth_covariance
from nearfar.priors.responses import VARIANCE_RATIOS, ResponsePrior
from nearfar.transport import near


def is_clipped(centres: NDArray[np.int64], near_basis: NearBasis, projector: Size) -> Booleans:
    """Return whether the border cuts into the window about each rounded q, shape (C,)."""
    xp = namespace(centres)
    never_inside = beside(~reachable(near_basis.window, projector), centres)
    inside = near.inside(centres, near_basis.window, projector)
    found: Booleans = ~xp.all(inside | never_inside, axis=1)
    return found


def rounded_ratio(ratio: Floats) -> Floats:
    """Round variance ratios to the nearest power of 2, so that camera pixels share them."""
    xp = namespace(ratio)
    within = xp.clip(ratio, float(VARIANCE_RATIOS[0]), float(VARIANCE_RATIOS[-1]))
    power: Floats = 2.0 ** xp.round(xp.log2(within))
    return power


class Clippings(NamedTuple):
    """The parts of camera pixels' windows that lie on the projector, each a rectangle.

    Attributes
    ----------
    rows, columns : list of slice
        Rows and columns of each rectangle that occurs.
    rectangle : ndarray of int, shape (n,)
        Index of each camera pixel's rectangle.
    """

    rows: list[slice]
    columns: list[slice]
    rectangle: Integers


class Ratios(NamedTuple):
    """The distinct variance ratios of pairs, and the weights that follow from each.

    Attributes
    ----------
    values : ndarray, shape (V,)
        Each of those that occur, rounded.
    of_pair : ndarray of int, shape (m,)
        Index of each pair's value.
    weights : ndarray, shape (V, R), float64
        1 / D.
    """

    values: Floats
    of_pair: Integers
    weights: Floats


def clippings_of(inside: Booleans) -> Clippings:
    """Find the rectangles that the entries inside, (n, W^2), form."""
    side = round(np.sqrt(inside.shape[1]))
    square = inside.reshape(-1, side, side)
    sides: list[Booleans] = [np.any(square, axis=axis) for axis in (2, 1)]
    ends = np.stack(
        [end for on in sides for end in (on.argmax(axis=1), side - on[:, ::-1].argmax(axis=1))],
        axis=1,
    )
    found, rectangle = np.unique(ends, axis=0, return_inverse=True)
    rows = [slice(int(top), int(bottom)) for top, bottom, _, _ in found]
    columns = [slice(int(first), int(last)) for _, _, first, last in found]
    return Clippings(rows, columns, rectangle.ravel())


def solve_windows(
    right: Floats,
    clippings: Clippings,
    of: Integers,
    prior: ResponsePrior,
    ratios: Ratios,
    centred: CentredBasis,
) -> Floats:
    """Return Lambda^-1 times vectors of camera pixels' windows.

    Parameters
    ----------
    right : ndarray, shape (m, k, W^2), float64
    clippings : Clippings
    of : ndarray of int, shape (m,)
        Indices of camera pixels among those of `clippings`.
    prior : ResponsePrior
    ratios : Ratios
    centred : CentredBasis

    Returns
    -------
    ndarray, shape (m, k, W^2), float64
        0 beyond the border.
    """
    xp = namespace(right)
    count, side = len(clippings.rows), round(np.sqrt(right.shape[-1]))
    deviation = beside(prior.factors.deviation, right)
    entry_indices = np.arange(side * side).reshape(side, side)
    numbers = beside(np.arange(right.shape[1])[:, None], right)
    solved: Floats = xp.zeros_like(right)
    # Pairs of one value and one rectangle follow each other.
    group = ratios.of_pair * count + clippings.rectangle[of]
    order = np.argsort(group, kind="stable")
    first_of_group = np.flatnonzero(np.diff(group[order], prepend=-1))
    precisions: dict[int, Floats] = {}
    scaled = _information(centred, ratios.weights)
    scaled *= deviation
    scaled *= deviation[:, None]
    entries = scaled.reshape((-1, side, side, side, side))
    for pairs in np.split(order, first_of_group[1:]) if len(order) else ():
        value, one = divmod(int(group[pairs[0]]), count)
        rows, columns = clippings.rows[one], clippings.columns[one]
        inner = entry_indices[rows, columns]
        if one not in precisions:
            precisions[one] = _smooth_precision(prior, inner)
        at = (beside(pairs[:, None, None], right), numbers, beside(inner.ravel(), right))
        matrix = entries[value, rows, columns, rows, columns].reshape((inner.size, inner.size))
        matrix = matrix + beside(precisions[one] / ratios.values[value], right)
        found = xp.linalg.solve(matrix, right[at].reshape((-1, inner.size)).T).T
        solved[at] = found.reshape((len(pairs), right.shape[1], inner.size))
    return solved


def _information(centred: CentredBasis, weights: Floats) -> Floats:
    """Return the information matrices B^T D^-1 B of weights (V, R), (V, W^2, W^2).

    A cosine and its sine of one weight add up to the cosine of the difference of two entries, so
    there is one number for each difference.
    """
    xp = namespace(weights)
    cosine = np.flatnonzero(~centred.basis.is_sine)
    parts = np.diff(np.append(cosine, centred.basis.count))
    given = fetch(weights)
    information: Floats
    of_cosine = given[:, cosine]
    if np.any(np.abs(of_cosine - given[:, cosine + parts - 1]) > 1e-6 * of_cosine):
        patterns = xp.astype(centred.on_window, xp.float64)
        information = (patterns.T * weights[:, None]) @ patterns
        return information
    window = round(np.sqrt(centred.on_window.shape[1]))
    down, across = centred.side_waves
    of_difference = np.real((down.T * of_cosine[:, None]) @ across)
    # [y, x, y', x'] is of_difference[y - y', x - x'], counted from the middle.
    apart = np.subtract.outer(np.arange(window), np.arange(window)) + window - 1
    tables = of_difference[:, apart[:, None, :, None], apart[None, :, None, :]]
    information = beside(tables.reshape(-1, window**2, window**2), weights)
    return information


def _smooth_precision(prior: ResponsePrior, entry_indices: Integers) -> Floats:
    """Return (smooth + diag(independent))^-1 over a rectangle of window entries."""
    independent = prior.factors.independent[entry_indices.ravel()]
    everywhere = float(prior.factors.independent.min())
    found = _inverse_of_smooth(CORRELATION_LENGTH, *entry_indices.shape, everywhere).copy()
    # Entries around q may have a larger independent variance: a correction of low rank.
    more = np.flatnonzero(independent > everywhere)
    if len(more):
        columns = found[:, more]
        small = np.diag(1.0 / (independent[more] - everywhere)) + columns[more]
        found -= columns @ np.linalg.solve(small, columns.T)
    return found


@lru_cache(maxsize=128)
def _inverse_of_smooth(length: float, height: int, width: int, independent: float) -> Floats:
    """Return (smooth + independent)^-1 over a rectangle, by the eigenvectors of its sides."""
    sides = [np.linalg.eigh(smooth_covariance(length, side)) for side in (height, width)]
    (eigenvalues_y, vectors_y), (eigenvalues_x, vectors_x) = sides
    if independent == 0:
        inverses = ((vectors / eigenvalues) @ vectors.T for eigenvalues, vectors in sides)
        return np.asarray(np.kron(*inverses))
    vectors = np.kron(vectors_y, vectors_x)
    eigenvalues = np.kron(eigenvalues_y, eigenvalues_x) + independent
    return np.asarray((vectors / eigenvalues) @ vectors.T)
