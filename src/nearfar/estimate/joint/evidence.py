"""Which kind a camera pixel is, and how strong its light: what its photos make most probable.

The log of the evidence of a kind at strength s, noise sigma and eigenvalues l_i is, but for a
constant, -1/2 sum_i (y_i^2 / v_i + log v_i), v_i = s^2 l_i + sigma^2, with o and d integrated
out. v_i depends on s and sigma through their ratio alone, so every camera pixel shares one table
over ratios, and the sums over i are matrix products.

Index convention: arrays are (n, channels, ...); i runs over eigenvectors, t over table entries.
"""

from collections.abc import Sequence

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.estimate.joint.nuisance import precision
from nearfar.estimate.joint.pixels import Pixels
from nearfar.estimate.joint.prior import Prior
from nearfar.transport.kinds import STRENGTHS

# The table's step in (s / sigma)^2.
STEP = 2.0**0.25


def best_kind(pixels: Pixels, priors: Sequence[Prior]) -> tuple[Integers, Floats, Floats]:
    """Choose a kind and a strength for each camera pixel, the same for all channels.

    Parameters
    ----------
    pixels : Pixels
    priors : sequence of Prior

    Returns
    -------
    kind : ndarray of int, shape (n,)
        Place in `priors`.
    strength : ndarray, shape (n,)
        s as a share of white.
    evidence : ndarray, shape (n,)
        Its logarithm, but for a constant of the camera pixel.
    """
    number = len(pixels.white)
    best = np.full(number, -np.inf)
    kind = np.zeros(number, dtype=np.int64)
    strength = np.full(number, STRENGTHS[0])
    known = precision(pixels)
    for place, prior in enumerate(priors):
        found = evidence(pixels, prior, known)
        top = np.argmax(found, axis=1)
        value = found[np.arange(number), top]
        better = value > best
        best[better] = value[better]
        kind[better] = place
        strength[better] = np.array(STRENGTHS)[top[better]]
    return kind, strength, best


def evidence(pixels: Pixels, prior: Prior, known: Floats) -> Floats:
    """Log evidence of one kind at every strength, all channels together, (n, strengths)."""
    number, channels = pixels.white.shape
    ratio = (pixels.white / pixels.noise).astype(np.float64) ** 2
    first = np.floor(np.log(ratio * STRENGTHS[0] ** 2) / np.log(STEP)).astype(np.int64)
    steps = np.log((np.array(STRENGTHS) / STRENGTHS[0]) ** 2) / np.log(STEP)
    steps = np.rint(steps).astype(np.int64)
    lowest = first.min()
    count = int(first.max() - lowest + steps[-1] + 1)
    table = STEP ** (np.arange(count) + lowest + 0.5)
    variance = 1.0 + table * prior.levels.astype(np.float64)[:, None]
    weight = (1.0 / variance).astype(np.float32)
    spread = np.log(variance).sum(axis=0)

    y = (pixels.answers / pixels.noise[..., None]) @ prior.directions
    v = pixels.of_offset @ prior.directions
    u = pixels.of_direct @ prior.directions
    yy = (y * y) @ weight
    vy, uy = (v[:, None] * y) @ weight, (u[:, None] * y) @ weight
    vv, uv, uu = (v * v) @ weight, (u * v) @ weight, (u * u) @ weight
    total = np.zeros((number, len(steps)))
    rows = np.arange(number)[:, None]
    for i in range(channels):
        entry = (first[:, i, None] - lowest) + steps
        # v and u are in photo units, y in units of the noise.
        scale = 1.0 / pixels.noise[:, i, None].astype(np.float64)
        offset, direct = known[:, i, None, 0], known[:, i, None, 1]
        a = vv[rows, entry] * scale**2 + offset
        b = uv[rows, entry] * scale**2
        c = uu[rows, entry] * scale**2 + direct
        e, f = vy[rows, i, entry] * scale, uy[rows, i, entry] * scale
        determinant = a * c - b * b
        explained = (c * e * e - 2 * b * e * f + a * f * f) / determinant
        total -= 0.5 * (
            yy[rows, i, entry] - explained + spread[entry] + np.log(determinant / (offset * direct))
        )
    return total
