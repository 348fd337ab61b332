"""Which kind a camera pixel is, and how strong its light: what its photos make most probable.

The log of the evidence of a kind at strength s, noise sigma and eigenvalues l_i is, but for a
constant, -1/2 sum_i (y_i^2 / v_i + log v_i), v_i = s^2 l_i + sigma^2, with o and d integrated out.
v_i depends on s and sigma through their ratio alone, so every camera pixel shares one table over
ratios, and the sums over i are matrix products.

Channels are not put together first: of their mean, the shelf's coloured books lose 1.2 dB under a
random light.

Index convention: arrays are (n, channels, ...); i runs over eigenvectors.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, Integers, product
from nearfar.estimate.joint.nuisance import UNKNOWN
from nearfar.estimate.joint.pixels import Pixels
from nearfar.estimate.joint.prior import Prior
from nearfar.transport.kinds import STRENGTHS

# Steps of the table in (s / sigma)^2, between two strengths: they are 2 apart.
STEPS = 4


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
    best = np.full(number, -np.inf, dtype=np.float32)
    kind = np.zeros(number, dtype=np.int64)
    strength = np.full(number, STRENGTHS[0])
    told = Told(
        answers=pixels.answers / pixels.noise[..., None],
        ratio=pixels.white / pixels.noise,
        offset_ratio=pixels.offset_noise / pixels.noise,
        corners=pixels.corners[:, 0],
        of_offset=pixels.of_offset,
    )
    for place, prior in enumerate(priors):
        found = evidence(told, prior)
        top = np.argmax(found, axis=1)
        value = found[np.arange(number), top]
        better = value > best
        best[better] = value[better]
        kind[better] = place
        strength[better] = np.array(STRENGTHS)[top[better]]
    return kind, strength, best


class Told(NamedTuple):
    """What the answers of camera pixels tell.

    Attributes
    ----------
    answers : ndarray, shape (n, channels, R)
        In units of their noise.
    ratio, offset_ratio : ndarray, shape (n, channels)
        White, and the deviation of the references' error, over that noise.
    corners : ndarray, shape (n, 9)
        Unit direct light around q.
    of_offset : ndarray, shape (n, 0 or 1, R)
        Answers of a unit error of the references; left out where they cannot err.
    """

    answers: Floats
    ratio: Floats
    offset_ratio: Floats
    corners: Floats
    of_offset: Floats


def evidence(told: Told, prior: Prior) -> Floats:
    """Return the log evidence of one kind at every strength, of all channels, (n, strengths)."""
    level = np.rint(STEPS * np.log2(told.ratio.astype(np.float64) * STRENGTHS[0])).astype(np.int64)
    y = product(told.answers, prior.directions)
    u = told.corners @ prior.of_corners
    v = product(told.of_offset, prior.directions)[:, 0] if told.of_offset.shape[1] else None
    found = np.zeros((len(y), len(STRENGTHS)), dtype=np.float32)
    for first in np.unique(level):
        table = 4.0 ** ((first + STEPS * np.arange(len(STRENGTHS))) / STEPS)
        variance = 1.0 + table * prior.levels.astype(np.float64)[:, None]
        weight = (1.0 / variance).astype(np.float32)
        spread = np.log(variance).sum(axis=0).astype(np.float32)
        for i in range(level.shape[1]):
            mine = np.flatnonzero(level[:, i] == first)
            of_y, of_u = y[mine, i], u[mine]
            yy, uy, uu = ((a * b) @ weight for a, b in ((of_y, of_y), (of_u, of_y), (of_u, of_u)))
            # d in units of the noise: UNKNOWN times white, beforehand.
            before = (UNKNOWN * told.ratio[mine, i, None]) ** 2
            if v is not None:
                # o first, so that what is left of y and u knows nothing of it.
                of_v = v[mine]
                vy, vu, vv = (
                    (a * b) @ weight for a, b in ((of_v, of_y), (of_v, of_u), (of_v, of_v))
                )
                known = told.offset_ratio[mine, i, None] ** 2
                free = 1.0 + known * vv
                yy, uy, uu = (
                    whole - known * of * by / free
                    for whole, of, by in ((yy, vy, vy), (uy, vu, vy), (uu, vu, vu))
                )
                found[mine] -= 0.5 * np.log(free)
            free = 1.0 + before * uu
            found[mine] -= 0.5 * (yy - before * uy**2 / free + spread + np.log(free))
    return found
