"""The posterior mean where the projector's border cuts the window: entries beyond it are zero.

f and noise together have a diagonal covariance s^2 S + sigma^2 / m = sigma^2 D, so the window can
be solved for by itself: with n = diag(deviation) z, z has the precision

    Lambda = (smooth + diag(alone))^-1 / ratio + diag(deviation) B^T D^-1 B diag(deviation)

over the entries inside, ratio = (s / sigma)^2 and B the patterns over the window. Camera pixels
whose windows are cut alike, of one kind and of ratios that are close, share one factor of Lambda;
strengths are tried in steps of 2, so a ratio rounded to the nearest power of 2 is as good.

Index convention: arrays are (n, channels, ...); r runs over real responses, w over window entries
inside, g over y and the numbers of `nuisance`; m over pairs of a camera pixel and a channel.
"""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from array_api_compat import device

from nearfar.arrays import Booleans, Floats, Integers, beside, fetch, namespace, product
from nearfar.estimate.joint import nuisance
from nearfar.estimate.joint.pixels import Pixels
from nearfar.estimate.joint.prior import RATIOS, Prior
from nearfar.estimate.joint.solve import Found, near_noise
from nearfar.estimate.matrices import Band
from nearfar.transport.kinds import CORRELATION, smooth_side


def rounded(ratio: Floats) -> Floats:
    """Round to the nearest power of 2, so that camera pixels share them."""
    xp = namespace(ratio)
    power: Floats = 2.0 ** xp.round(xp.log2(xp.clip(ratio, float(RATIOS[0]), float(RATIOS[-1]))))
    return power


def solve_cut(pixels: Pixels, prior: Prior, ratio: Floats, band: Band) -> Found:
    """Estimate camera pixels of one kind; see `solve_whole`."""
    xp = namespace(pixels.responses)
    number, channels, count = pixels.responses.shape
    # m, how often each answer was measured: the squares of a row add up to it.
    multiplicity = xp.sum(xp.astype(prior.directions, xp.float64) ** 2, axis=1)
    power, deviation = (
        beside(values, pixels.responses) for values in (prior.power, prior.factors.deviation)
    )
    columns = nuisance.columns(pixels, band)
    known = nuisance.precision(pixels)
    spread = xp.astype(band.on_window, xp.float64) * deviation
    rectangles = _rectangles(fetch(pixels.inside))

    def empty(*shape: int, dtype: Any = None) -> Any:
        return xp.empty(shape, dtype=dtype or xp.float32, device=device(pixels.responses))

    shared = empty(*known.shape, dtype=xp.float64)
    near = empty(number, channels, len(deviation))
    far, left = empty(number, channels, count), empty(number, channels, count)
    rounded_to = fetch(ratio)
    for value in np.unique(rounded_to):
        weight = 1.0 / (float(value) * power + 1.0 / multiplicity)
        of, channel = np.nonzero(rounded_to == value)
        c, i = beside(of, known), beside(channel, known)
        y = xp.astype(xp.concat([pixels.responses[c, i, None], columns[c]], axis=1), xp.float64)
        weighed = y * weight
        told = product(weighed, spread)
        solved = _solved(told, rectangles, of, prior, float(value), weight, band)
        products = y @ xp.permute_dims(weighed, (0, 2, 1))
        products -= told @ xp.permute_dims(solved, (0, 2, 1))
        variance = xp.astype(pixels.noise[c, i], xp.float64)[:, None] ** 2
        products /= variance[..., None]
        shared[c, i] = nuisance.solve(products[:, 1:, 1:], products[:, 1:, 0], known[c, i])
        kept = xp.concat([xp.ones_like(shared[c, i][:, :1]), -shared[c, i]], axis=1)[:, None]
        window = (kept @ solved)[:, 0]
        rest = ((kept @ y)[:, 0] - window @ spread.T) * weight
        near[c, i] = xp.astype(window * deviation, xp.float32)
        far[c, i] = xp.astype(rest * (float(value) * power), xp.float32)
        left[c, i] = xp.astype(rest / variance, xp.float32)
    return Found(
        shared=nuisance.laid_out(shared, pixels),
        near=near,
        far=far,
        near_noise=near_noise(pixels, prior, ratio),
        pull=product(left, band.on_window),
    )


class _Rectangles(NamedTuple):
    """What the border leaves of the windows of camera pixels.

    Attributes
    ----------
    rows, columns : list of slice
        Of the window, for each way in which some are cut.
    way : ndarray of int, shape (n,)
        The way of each camera pixel.
    """

    rows: list[slice]
    columns: list[slice]
    way: Integers


def _rectangles(inside: Booleans) -> _Rectangles:
    """Find the rectangles that the entries inside make, (n, W^2)."""
    side = round(np.sqrt(inside.shape[1]))
    square = inside.reshape(-1, side, side)
    sides: list[Booleans] = [np.any(square, axis=axis) for axis in (2, 1)]
    ends = np.stack(
        [end for on in sides for end in (on.argmax(axis=1), side - on[:, ::-1].argmax(axis=1))],
        axis=1,
    )
    found, way = np.unique(ends, axis=0, return_inverse=True)
    rows = [slice(int(top), int(bottom)) for top, bottom, _, _ in found]
    columns = [slice(int(first), int(last)) for _, _, first, last in found]
    return _Rectangles(rows, columns, way.ravel())


def _solved(
    told: Floats,
    rectangles: _Rectangles,
    of: Integers,
    prior: Prior,
    ratio: float,
    weight: Floats,
    band: Band,
) -> Floats:
    """Lambda^-1 times vectors (m, 1 + G, W^2) of camera pixels `of`, 0 beyond the border."""
    xp = namespace(told)
    side = round(np.sqrt(told.shape[-1]))
    deviation = beside(prior.factors.deviation, told)
    scaled = _information(band, weight) * deviation * deviation[:, None]
    entries = scaled.reshape((side, side, side, side))
    places = np.arange(side * side).reshape(side, side)
    solved: Floats = xp.zeros_like(told)
    way = rectangles.way[of]
    for one in np.unique(way):
        rows, columns = rectangles.rows[one], rectangles.columns[one]
        inner = places[rows, columns].ravel()
        chosen = beside(np.flatnonzero(way == one)[:, None, None], told)
        numbers = beside(np.arange(told.shape[1])[:, None], told)
        put = (chosen, numbers, beside(inner, told))
        precision = _smooth_precision(prior, places[rows, columns]) / ratio
        factor = entries[rows, columns, rows, columns].reshape((len(inner), len(inner)))
        factor = factor + beside(precision, told)
        right = told[put].reshape((-1, len(inner)))
        found = xp.linalg.solve(factor, right.T).T
        solved[put] = found.reshape((len(chosen), told.shape[1], len(inner)))
    return solved


def _information(band: Band, weight: Floats) -> Floats:
    """Return what tells B^T D^-1 B, (W^2, W^2).

    A cosine and its sine, known alike, add up to the cosine of the difference of two entries, so
    there is one number for each difference.
    """
    xp = namespace(weight)
    cosine = np.flatnonzero(~band.basis.is_sine)
    parts = np.diff(np.append(cosine, band.basis.count))
    alike = fetch(weight)
    every: Floats
    if not np.allclose(alike[cosine], alike[cosine + parts - 1], rtol=1e-6):
        patterns = xp.astype(band.on_window, xp.float64)
        every = (patterns.T * weight) @ patterns
        return every
    window = round(np.sqrt(band.on_window.shape[1]))
    side = np.arange(1 - window, window)
    waves = [np.exp(2j * np.pi * band.basis.cycles[:, axis, None] * side) for axis in (0, 1)]
    told = np.real((waves[0].T * alike[cosine]) @ waves[1])
    # [y, x, y', x'] is told[y - y', x - x'], counted from the middle.
    apart = np.subtract.outer(np.arange(window), np.arange(window)) + window - 1
    table = told[apart[:, None, :, None], apart[None, :, None, :]]
    every = beside(table.reshape(window**2, window**2), weight)
    return every


def _smooth_precision(prior: Prior, places: Integers) -> Floats:
    """(smooth + diag(alone))^-1 over the entries at `places`, which are a rectangle of them."""
    alone = prior.factors.alone[places.ravel()]
    everywhere = float(prior.factors.alone.min())
    found = _inverse_of_smooth(CORRELATION, *places.shape, everywhere).copy()
    # Entries around q may have more of their own: a correction of a few ranks.
    more = np.flatnonzero(alone > everywhere)
    if len(more):
        columns = found[:, more]
        small = np.diag(1.0 / (alone[more] - everywhere)) + columns[more]
        found -= columns @ np.linalg.solve(small, columns.T)
    return found


@lru_cache(maxsize=128)
def _inverse_of_smooth(correlation: float, height: int, width: int, alone: float) -> Floats:
    """(smooth + alone)^-1 over a rectangle, by the eigenvectors of its sides."""
    sides = [np.linalg.eigh(smooth_side(correlation, side)) for side in (height, width)]
    (levels_y, vectors_y), (levels_x, vectors_x) = sides
    if alone == 0:
        inverses = ((v / levels) @ v.T for levels, v in sides)
        return np.asarray(np.kron(*inverses))
    vectors = np.kron(vectors_y, vectors_x)
    return np.asarray((vectors / (np.kron(levels_y, levels_x) + alone)) @ vectors.T)
