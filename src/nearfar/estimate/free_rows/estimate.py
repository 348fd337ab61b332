"""Free rows of camera pixels from photos of known patterns, by a prior that shrinks.

Each camera pixel's row is b, m and r as in `nearfar.estimate.free_rows.design`, and light d of one
lamp q more, where that is more probable. With rho = (s / sigma)^2 the photos in direction i have
the variance sigma^2 K_i, K_i = rho S_i^2 + 1. The noise sigma has the value that makes the photos
most probable, and rho is chosen by the evidence

    -f/2 log(sum_i z_i^2 / K_i + e) - 1/2 sum_i log K_i,   z = V^T y,

e the power of what is noise alone and f the number of directions. Where the patterns tell all lamps
apart and no photo is to spare, the noise cannot be told, and rows are least squares.

Index convention: arrays are (n, channels, ...), n camera pixels; i runs over directions, p over
lamps, t over variance ratios.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Integers
from nearfar.estimate.free_rows.design import Design
from nearfar.transport.posterior import LEAST_SQUARES, FreePosterior

# Variance ratios to choose among, times the mean power of the directions.
RATIOS = np.logspace(-3, 9, 25)
# How often the lamp of direct light is looked for, at the ratio that the last one asks for.
SEARCHES = 2
# A power of noise below this share of the photos' is rounding in float32.
LEAST_POWER = 1e-13


class FreeRows(NamedTuple):
    """Rows of camera pixels, in photo units, float32.

    Attributes
    ----------
    black, direct : ndarray, shape (n, channels)
    free : ndarray, shape (n, channels, P)
        Light from each lamp, without the direct light.
    lamp : ndarray of int, shape (n,)
        q; -1 without direct light.
    noise : ndarray, shape (n, channels)
        Standard deviation of a photo; 0 where the photos cannot tell.
    ratio : ndarray, shape (n,)
        rho; infinite for least squares.
    """

    black: Floats
    direct: Floats
    free: Floats
    lamp: Integers
    noise: Floats
    ratio: Floats


class _Seen(NamedTuple):
    """Photos of camera pixels, taken apart: z (n, channels, k), and e and the power (n, channels).

    `span` is the largest photo less the smallest, (n, channels).
    """

    values: Floats
    noise: Floats
    span: Floats


def ratios_of(design: Design) -> Floats:
    """Return the variance ratios that are chosen among, rising, (t,)."""
    if not len(design.strengths):
        return np.ones(1)
    return np.asarray(RATIOS / np.mean(design.strengths**2))


def estimate_free_rows(
    photos: Floats, design: Design, lamps: NDArray[np.int64] | None = None
) -> FreeRows:
    """Estimate the rows of camera pixels.

    Parameters
    ----------
    photos : ndarray, shape (n, channels, N)
    design : Design
    lamps : ndarray of int, shape (n,), optional
        The lamp that lights each camera pixel directly, -1 for none; by default the most probable.

    Returns
    -------
    FreeRows
    """
    y = photos.astype(np.float64)
    z = y @ design.directions
    left = (y**2).sum(axis=2) - ((y @ design.basis) ** 2).sum(axis=2)
    noise = np.maximum(left - (z**2).sum(axis=2), LEAST_POWER * (y**2).sum(axis=2) + 1e-30)
    seen = _Seen(z, noise, np.ptp(y, axis=2))
    ratios = ratios_of(design)
    without, _power = _evidence(seen, design, ratios)
    choice = without.argmax(axis=1)
    if lamps is None:
        found, with_direct, lit_choice = _search(seen, design, ratios, choice)
        is_lit = with_direct - np.log(design.lamps) > without.max(axis=1)
    else:
        found = np.maximum(lamps, 0)
        evidence, _ = _evidence_with(seen, design, ratios, found)
        lit_choice, is_lit = evidence.argmax(axis=1), lamps >= 0
    ratio = ratios[np.where(is_lit, lit_choice, choice)]
    if design.is_complete and not design.spare:
        ratio = np.full(len(z), LEAST_SQUARES)
    return _solve(y, seen, design, ratio, np.where(is_lit, found, -1))


def _evidence(seen: _Seen, design: Design, ratios: Floats) -> tuple[Floats, Floats]:
    """Return the log evidence without direct light, (n, t), and the power, (n, channels, t)."""
    spread = ratios[:, None] * design.strengths**2 + 1.0
    power = (seen.values**2) @ (1.0 / spread).T + seen.noise[..., None]
    count = max(1, design.seen)
    each = count * np.log(power / count) + np.log(spread).sum(axis=1)
    return -0.5 * each.sum(axis=1), power


def _evidence_with(
    seen: _Seen, design: Design, ratios: Floats, lamps: Integers
) -> tuple[Floats, Floats]:
    """Return the log evidence with direct light from a lamp, (n, t), and d, (n, channels, t)."""
    inverse = 1.0 / (ratios[:, None] * design.strengths**2 + 1.0)
    mine = design.of_lamps.T[lamps]
    overlap = (seen.values * mine[:, None]) @ inverse.T
    own = (mine**2) @ inverse.T
    told = own > 1e-12 * max(float(own.max(initial=0.0)), 1e-300)
    own = np.where(told, own, np.inf)[:, None]
    direct = overlap / own
    _, power = _evidence(seen, design, ratios)
    count = max(1, design.seen - 1)
    left = np.maximum(power - overlap * direct, seen.noise[..., None])
    sigma = np.sqrt(left / count)
    # Before any photo d may be as large as the light that the camera pixel has at all.
    prior = np.log(np.maximum(seen.span[..., None] * np.sqrt(own) / sigma, 1.0))
    each = count * np.log(left / count) - np.log(inverse).sum(axis=1) + 2 * prior
    evidence = np.where(told & (direct.sum(axis=1) > 0), -0.5 * each.sum(axis=1), -np.inf)
    return evidence, direct


def _search(
    seen: _Seen, design: Design, ratios: Floats, choice: Integers
) -> tuple[Integers, Floats, Integers]:
    """Return the most probable lamp of direct light, its log evidence, and its ratio's number."""
    count = len(seen.values)
    best = np.zeros(count, dtype=np.int64)
    if not len(design.strengths):
        return best, np.full(count, -np.inf), np.zeros(count, dtype=np.int64)
    for _ in range(SEARCHES):
        for number in np.unique(choice):
            mine = np.flatnonzero(choice == number)
            best[mine] = _likeliest_lamps(_some(seen, mine), design, float(ratios[number]))
        evidence, _direct = _evidence_with(seen, design, ratios, best)
        choice = evidence.argmax(axis=1)
    return best, evidence.max(axis=1), choice


def _some(seen: _Seen, chosen: Integers) -> _Seen:
    return _Seen(*(part[chosen] for part in seen))


def _likeliest_lamps(seen: _Seen, design: Design, ratio: float) -> Integers:
    """Return the lamp whose direct light explains most at one variance ratio, (n,)."""
    inverse = 1.0 / (ratio * design.strengths**2 + 1.0)
    own = inverse @ design.of_lamps**2
    told = own > 1e-12 * own.max()
    weighed = seen.values * inverse
    overlap = weighed @ design.of_lamps
    power = (weighed * seen.values).sum(axis=2) + seen.noise
    explained = np.where(overlap > 0, overlap, 0.0) ** 2 / np.where(told, own, np.inf)
    left = np.maximum(power[..., None] - explained, seen.noise[..., None])
    return np.asarray(np.log(left).sum(axis=1).argmin(axis=1))


def _solve(
    y: Floats, seen: _Seen, design: Design, ratio: Floats, lamp: NDArray[np.int64]
) -> FreeRows:
    """Return posterior means at a variance ratio and a lamp of direct light for each pixel."""
    strengths = design.strengths
    finite = np.where(np.isfinite(ratio), ratio, 1.0)[:, None]
    is_least_squares = ~np.isfinite(ratio)[:, None]
    # K^-1, and times rho S: K^-1 / rho = 1 / S^2 for least squares.
    inverse = np.where(is_least_squares, strengths**-2.0, 1.0 / (finite * strengths**2 + 1.0))
    shrink = np.where(is_least_squares, 1.0 / strengths, finite * strengths * inverse)
    lit: Booleans = lamp >= 0
    mine = design.of_lamps.T[np.maximum(lamp, 0)] * lit[:, None]
    own = (mine**2 * inverse).sum(axis=1)
    overlap = (seen.values * (mine * inverse)[:, None]).sum(axis=2)
    direct = np.maximum(overlap / np.where(own > 0, own, np.inf)[:, None], 0.0)
    left = seen.values - direct[..., None] * mine[:, None]
    rows = (left * shrink[:, None]) @ design.modes
    sequences = y - rows @ design.patterns.T
    sequences -= (
        direct[..., None] * (design.patterns.T[np.maximum(lamp, 0)] * lit[:, None])[:, None]
    )
    known = sequences @ design.from_known.T
    black = known[..., 0] if design.has_black else np.zeros(known.shape[:2])
    power = (left**2 * inverse[:, None]).sum(axis=2) + seen.noise
    count = np.maximum(1, design.seen - lit)[:, None]
    noise = np.where(is_least_squares, 0.0, np.sqrt(power / count))
    return FreeRows(
        black=black.astype(np.float32),
        direct=direct.astype(np.float32),
        free=(rows + known[..., -1:]).astype(np.float32),
        lamp=lamp,
        noise=noise.astype(np.float32),
        ratio=ratio.astype(np.float32),
    )


def posterior_of(design: Design, ratio: Floats) -> FreePosterior | None:
    """Return the posterior at variance ratios; None where the photos do not tell their noise."""
    if not design.spare and design.is_complete:
        return None
    return FreePosterior(
        modes=design.modes.astype(np.float32),
        strengths=design.strengths.astype(np.float32),
        mean=design.mean.astype(np.float32),
        mean_variance=float((design.from_known[-1] ** 2).sum()),
        gain_errors=np.zeros((0, design.lamps), np.float32),
        variance_ratio=ratio,
    )
