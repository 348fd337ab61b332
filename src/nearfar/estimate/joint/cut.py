"""The posterior mean where the projector's border cuts the window: entries beyond it are zero.

f and noise together have a diagonal covariance s^2 S + sigma^2 / m = sigma^2 D, so the window can
be solved for by itself: with n = diag(deviation) z, z has the precision

    Lambda = (smooth + diag(alone))^-1 / ratio + diag(deviation) B^T D^-1 B diag(deviation)

over the entries inside, ratio = (s / sigma)^2 and B the patterns over the window. Camera pixels
whose windows are cut alike, of one kind and of ratios that are close, share one factor of Lambda;
strengths are tried in steps of 2, so a ratio rounded to the nearest power of 2 is as good.

Index convention: arrays are (n, channels, ...); r runs over real answers, w over window entries
inside, g over y and the numbers of `nuisance`; m over pairs of a camera pixel and a channel.
"""

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from scipy import linalg

from nearfar.arrays import Booleans, Floats, Integers, product
from nearfar.estimate.joint import nuisance
from nearfar.estimate.joint.pixels import Pixels
from nearfar.estimate.joint.prior import RATIOS, Prior
from nearfar.estimate.joint.solve import Found, near_noise
from nearfar.estimate.matrices import Band
from nearfar.transport.kinds import CORRELATION, smooth_side


def rounded(ratio: Floats) -> Floats:
    """Round to the nearest power of 2, so that camera pixels share them."""
    return np.asarray(2.0 ** np.rint(np.log2(np.clip(ratio, RATIOS[0], RATIOS[-1]))))


def solve_cut(pixels: Pixels, prior: Prior, ratio: Floats, band: Band) -> Found:
    """Estimate camera pixels of one kind; see `solve_whole`."""
    number, channels, _ = pixels.answers.shape
    # m, how often each answer was measured: the squares of a row add up to it.
    repeats = np.sum(prior.directions.astype(np.float64) ** 2, axis=1)
    columns = nuisance.columns(pixels, band)
    known = nuisance.precision(pixels)
    _, mask = np.unique(np.packbits(pixels.inside, axis=1), axis=0, return_inverse=True)
    deviation = prior.factors.deviation
    spread = band.on_window.astype(np.float64) * deviation
    shared = np.empty(known.shape)
    near = np.empty((number, channels, len(deviation)), dtype=np.float32)
    far, left = np.empty_like(pixels.answers), np.empty_like(pixels.answers)
    for value in np.unique(ratio):
        weight = 1.0 / (value * prior.power + 1.0 / repeats)
        c, i = np.nonzero(ratio == value)
        y = np.concatenate([pixels.answers[c, i, None], columns[c]], axis=1).astype(np.float64)
        weighed = y * weight
        told = product(weighed, spread)
        solved = _solved(told, pixels.inside[c], mask.ravel()[c], prior, value, weight, band)
        products = np.matmul(y, weighed.transpose(0, 2, 1))
        products -= np.matmul(told, solved.transpose(0, 2, 1))
        products /= pixels.noise[c, i, None, None].astype(np.float64) ** 2
        shared[c, i] = nuisance.solve(products[:, 1:, 1:], products[:, 1:, 0], known[c, i])
        kept = np.concatenate([np.ones((len(c), 1)), -shared[c, i]], axis=1)[:, None]
        window = np.matmul(kept, solved)[:, 0]
        rest = (np.matmul(kept, y)[:, 0] - window @ spread.T) * weight
        near[c, i] = window * deviation
        far[c, i] = rest * (value * prior.power)
        left[c, i] = rest / pixels.noise[c, i, None].astype(np.float64) ** 2
    return Found(
        shared=nuisance.laid_out(shared, pixels),
        near=near,
        far=far,
        near_noise=near_noise(pixels, prior, ratio),
        pull=product(left, band.on_window),
    )


def _solved(
    told: Floats,
    inside: Booleans,
    mask: Integers,
    prior: Prior,
    ratio: float,
    weight: Floats,
    band: Band,
) -> Floats:
    """Lambda^-1 times vectors (m, 1 + G, W^2), 0 beyond the border.

    `mask` (m,) numbers the ways in which windows are cut.
    """
    information = _information(band, weight)
    deviation = prior.factors.deviation
    solved = np.zeros_like(told)
    for place in np.unique(mask):
        chosen = np.flatnonzero(mask == place)
        cut = inside[chosen[0]]
        inner = np.flatnonzero(cut)
        factor = information(cut.reshape(prior.factors.smooth.shape))
        factor *= deviation[inner, None]
        factor *= deviation[inner]
        factor += _smooth_precision(prior, cut) / ratio
        factor, _ = linalg.cho_factor(factor, lower=True, overwrite_a=True, check_finite=False)
        some = told[chosen][..., inner]
        flat = some.reshape(-1, len(inner)).T
        found = linalg.cho_solve((factor, True), flat, check_finite=False)
        solved[chosen[:, None, None], np.arange(told.shape[1])[:, None], inner] = found.T.reshape(
            some.shape
        )
    return solved


def _information(band: Band, weight: Floats) -> Callable[[Booleans], Floats]:
    """Return what tells B^T D^-1 B among the entries of a rectangle of the window, (W, W).

    A cosine and its sine, known alike, add up to the cosine of the difference of two entries, so
    there is one number for each difference.
    """
    cosine = np.flatnonzero(~band.basis.is_sine)
    parts = np.diff(np.append(cosine, band.basis.count))
    if not np.allclose(weight[cosine], weight[cosine + parts - 1], rtol=1e-6):
        patterns = band.on_window.astype(np.float64)
        every = (patterns.T * weight) @ patterns
        return lambda square: np.asarray(every[np.ix_(square.ravel(), square.ravel())])
    window = round(np.sqrt(band.on_window.shape[1]))
    cycles = band.basis.cycles
    side = np.arange(1 - window, window)
    waves = [np.exp(2j * np.pi * cycles[:, axis, None] * side) for axis in (0, 1)]
    told = np.real((waves[0].T * weight[cosine]) @ waves[1])
    # [y, x, y', x'] is told[y - y', x - x'], counted from the middle.
    down, across = told.strides

    def among(square: Booleans) -> Floats:
        height, width = _sides(square)
        view = np.lib.stride_tricks.as_strided(
            told[window - 1 :, window - 1 :],
            (height, width, height, width),
            (down, across, -down, -across),
            writeable=False,
        )
        # A window of one row would come as a view of itself.
        return np.array(view).reshape(height * width, height * width)

    return among


def _sides(square: Booleans) -> tuple[int, int]:
    return int(square.any(axis=1).sum()), int(square.any(axis=0).sum())


def _smooth_precision(prior: Prior, inside: Booleans) -> Floats:
    """(smooth + diag(alone))^-1 over the entries inside, which are a rectangle."""
    height, width = _sides(inside.reshape(prior.factors.smooth.shape))
    alone = prior.factors.alone[np.flatnonzero(inside)]
    everywhere = float(prior.factors.alone.min())
    found = _inverse_of_smooth(CORRELATION, height, width, everywhere).copy()
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
