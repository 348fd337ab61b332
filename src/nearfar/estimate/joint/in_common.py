"""What rows without direct light have in common with their neighbours' rows.

Neighbours on one surface have like rows, and their mean is what a row is expected to be. Rows of no
order have nothing in common: their neighbours' mean is noise, and a camera pixel that starts from
it, or from its own photos, counts these twice. How much is in common follows from the products of
measured responses of neighbouring camera pixels, whose noises are independent. With M the variance
of a response that neighbours share, C that of what each has alone and V that of noise, the mean of
nine measured responses tells the shared part with the gain M / (M + (C + V) / 9).

Index convention: arrays are (Cy, Cx, channels, j), j over responses or rings of frequencies.
"""

import numpy as np
from array_api_compat import device

from nearfar.arrays import Floats, Integers, beside, namespace, product
from nearfar.estimate.joint.neighbours import rows_at_once
from nearfar.estimate.joint.pooled_choice import sum_of_neighbours
from nearfar.estimate.joint.problem import Problem
from nearfar.illumination.real_basis import RealBasis
from nearfar.parallel import in_batches

# Camera pixels on each side whose products are added up, about the 3 x 3 of each.
REACH = 2
# Camera pixels of a mean.
MEAN_OF = 9
# Standard deviations by which products may fall short by chance.
BY_CHANCE = 2.0


def keep_common(
    far: Floats, noise_left: Floats, problem: Problem, variance: Floats
) -> tuple[Floats, Floats]:
    """Keep of rows that neighbours lead to expect the share that they have in common.

    Rows stay as they are where they are alike, where noise hides whether they are, and where there
    is direct light, about whose q near- and far-range light are alike. Rows that have nothing in
    common become 0: such a camera pixel's own photos are all that tells its row.

    Parameters
    ----------
    far : ndarray, shape (Cy, Cx, channels, R)
        Responses of f that neighbours lead to expect; overwritten.
    noise_left : ndarray, shape (Cy, Cx, channels)
        Variance that noise has in them, as a share of that in a camera pixel's own responses.
    problem : Problem
    variance : ndarray, shape (Cy, Cx, channels)
        Of a response that was measured once, over white squared; above 0.

    Returns
    -------
    far, noise_left : ndarray
        Neighbours take noise off the share that is kept alone.
    """
    if bool(namespace(far).all(problem.pixels.lit)):
        return far, noise_left
    ring = _rings(problem.model.centred.basis)
    share = _share_in_common(problem, variance, ring)
    rings = beside(ring, far)

    def work(rows: slice) -> None:
        far[rows] *= share[rows][..., rings][..., None, :]

    in_batches(work, len(far), rows_at_once(far), far)
    number = beside(np.bincount(ring) / len(ring), far)
    of_all = namespace(far).sum(share * number, axis=-1)[..., None]
    return far, 1.0 - of_all * (1.0 - noise_left)


def _share_in_common(problem: Problem, variance: Floats, ring: Integers) -> Floats:
    """Return the share of what is expected that is kept, (Cy, Cx, rings); 1 with direct light."""
    pixels, camera, model = problem.pixels, problem.measurements.camera, problem.model
    xp, channels = namespace(pixels.white), problem.measurements.channels
    dark = xp.astype(~pixels.lit, xp.float32).reshape((*camera, 1))
    member = np.asarray(ring[:, None] == np.arange(ring.max() + 1), dtype=np.float32)
    number = beside(member.sum(axis=0), dark)
    # A response counts by how often it was measured, a camera pixel by the inverse of its variance.
    weight = dark / xp.mean(variance + _of_references(problem), axis=-1, keepdims=True)
    responses = pixels.responses.reshape((*camera, channels, -1))
    white = pixels.white.reshape((*camera, channels, 1))
    rings = beside(member, dark)
    products = xp.zeros((*camera, len(number)), dtype=xp.float32, device=device(dark))
    powers = xp.zeros_like(products)

    def work(rows: slice) -> None:
        first, last = max(rows.start - 1, 0), min(rows.stop + 1, camera.height)
        inner = slice(rows.start - first, rows.stop - first)
        values = responses[first:last] / white[first:last]
        values = values * xp.sqrt(model.multiplicity)
        own = weight[first:last, ..., None] * values
        others = sum_of_neighbours(own.reshape((*own.shape[:2], -1)), 1).reshape(own.shape) - own
        total = sum_of_neighbours(weight[first:last], 1) - weight[first:last]
        others = others / xp.clip(total[..., None], min=float(np.finfo(np.float32).tiny))
        products[rows] = xp.mean(product((own * others)[inner], rings), axis=-2)
        powers[rows] = xp.mean(product((own * values)[inner], rings), axis=-2)

    in_batches(work, camera.height, rows_at_once(responses), responses)
    pairs = dark * (sum_of_neighbours(dark, 1) - dark)
    products, powers, noise, pairs = (
        sum_of_neighbours(each, REACH) for each in (products, powers, dark * number, pairs)
    )
    by_chance = BY_CHANCE / xp.sqrt(xp.clip(pairs, min=1.0) * number * channels)
    share = _share(products, powers, noise, by_chance)
    found: Floats = xp.where((dark > 0) & (pairs > 0), share, xp.ones_like(share))
    return found


def _share(products: Floats, powers: Floats, noise: Floats, by_chance: Floats) -> Floats:
    """Return the gain of neighbours' mean over that of a row alone, at most 1.

    Parameters
    ----------
    products, powers : ndarray
        Sums of products with neighbours' means, and of squares.
    noise : ndarray
        What noise alone adds to the squares.
    by_chance : ndarray
        Standard deviations of products, over the squares, that are no sign of a difference.
    """
    xp = namespace(powers)
    told = powers > noise
    divisor = xp.where(told, powers, xp.ones_like(powers))
    shared = xp.clip(products / divisor + by_chance, min=0.0)
    by_noise = xp.where(told, noise / divisor, xp.ones_like(powers))
    signal = 1.0 - by_noise
    divisor = signal * (shared + (xp.clip(signal - shared, min=0.0) + by_noise) / MEAN_OF)
    found: Floats = xp.where(
        divisor > shared, shared / xp.where(divisor > 0, divisor, 1.0), xp.ones_like(shared)
    )
    return found


def _of_references(problem: Problem) -> Floats:
    """Return the variance that the references' error has in a response, over white squared."""
    pixels, camera = problem.pixels, problem.measurements.camera
    relative = pixels.offset_noise / pixels.white
    found: Floats = relative.reshape((*camera, -1)) ** 2
    return found


def _rings(basis: RealBasis) -> Integers:
    """Return the octave of frequencies of each response, counted from 0 without gaps, (R,)."""
    cycles = np.linalg.norm(basis.cycles * np.array(basis.projector), axis=1)[basis.index]
    octave = np.floor(np.log2(np.maximum(cycles, 1.0)))
    return np.asarray(np.unique(octave, return_inverse=True)[1])
