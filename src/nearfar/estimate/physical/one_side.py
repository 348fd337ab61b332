"""Inter-reflection that reaches the camera pixels of a translucent body from one side.

Where a body faces itself or another surface, light reaches q from across the crease. A kernel of
the medium is the same on both sides of q, and least squares make it too bright: it then has too
little on the side of the crease, and too much on the other. One blob of light, on the side where it
explains most, takes that light. A curved surface has more subsurface light on one side, too. So two
odd kernels are fitted as well, with either sign, and a blob must explain more than they do.

Index convention: c runs over the body's camera pixels, r over real responses, b over blobs.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, blocks
from nearfar.estimate.physical.body import BATCH_PIXELS, Body
from nearfar.estimate.physical.cells import REACH, groups, offsets
from nearfar.estimate.physical.kernels import kernel
from nearfar.estimate.physical.medium import (
    SLOPES,
    Media,
    amplitudes,
    fitted_again,
    kernels_of,
    power_of,
)
from nearfar.parallel import side_by_side

# Directions of blobs, their distance from q, and the standard deviation of their light, in cells.
DIRECTIONS, DISTANCE, DEVIATION = 8, 4.0, 2.0
# Camera pixels with this share of the body up to this distance, in cells, are far enough from its
# outline: next to it, a kernel that is cut off has light on one side as well.
SURROUNDED, AROUND = 0.95, 3.5
# With a blob, the misfit must be less than this share of that without.
LEAST_GAIN = 0.9
# A blob that the other terms explain but for this share of its power tells nothing.
LEAST_OWN = 1e-6


class _Found(NamedTuple):
    """What is found with light from one side.

    Attributes
    ----------
    direct, amplitude : ndarray, shape (n, channels)
        As in `Media`.
    light : ndarray, shape (n, channels, R)
        Responses to light from one side, 0 where there is none.
    """

    direct: Floats
    amplitude: Floats
    light: Floats


class _Terms(NamedTuple):
    """Fits of a channel without a blob, and what each blob changes.

    Attributes
    ----------
    misfit : ndarray, shape (n,)
        Without a blob.
    less : ndarray, shape (B, n)
        By how much the misfit is less with each.
    strength : ndarray, shape (B, n)
        Of each, at least 0.
    direct, amplitude : ndarray, shape (B, n)
        With each.
    """

    misfit: Floats
    less: Floats
    strength: Floats
    direct: Floats
    amplitude: Floats


def with_light_from_one_side(body: Body, media: Media) -> Media:
    """Return media fitted again, where light from one side is no subsurface light.

    Parameters
    ----------
    body : Body
    media : Media

    Returns
    -------
    Media
        `explained` is as before.
    """
    first = _from_one_side(body, media)
    if not first.light.any():
        return media
    without = replace(body, responses=body.responses - first.light)
    again = fitted_again(without, media)
    last = _from_one_side(body, again)
    return again._replace(direct=last.direct, amplitude=last.amplitude, explained=media.explained)


def _from_one_side(body: Body, media: Media) -> _Found:
    """Fit direct and subsurface light, with a blob of light where one explains much."""
    every = np.arange(len(body.pixels))
    terms, direct, amplitude = [], media.direct.copy(), media.amplitude.copy()
    for i, source in enumerate(media.sources):
        shape = kernels_of(body, source, media.slope, every)
        left = body.responses[:, i] - media.direct[:, i, None] * body.to_direct
        power = power_of(body, left - media.amplitude[:, i, None] * shape)
        direct[:, i], amplitude[:, i], _ = amplitudes(body, i, shape, power, every)
        terms.append(_terms(body, media, i, shape, power))
    misfit = body.share(np.sum([one.misfit for one in terms], axis=0))
    less = np.sum([one.less for one in terms], axis=0)
    less = np.stack([body.share(of_blob) for of_blob in less])
    best = less.argmax(axis=0)
    chosen = _surrounded(body) & (misfit - less[best, every] < LEAST_GAIN * misfit)
    light = np.zeros_like(body.responses)
    for number, blob in enumerate(_blobs()):
        some = np.flatnonzero(chosen & (best == number))
        of_unit = body.to_offsets(blob, some)
        for i, one in enumerate(terms):
            direct[some, i] = one.direct[number, some]
            amplitude[some, i] = np.maximum(one.amplitude[number, some], 0.0)
            light[some, i] = one.strength[number, some, None] * of_unit
    return _Found(direct, amplitude, light)


def _blobs() -> Floats:
    """Return light of a blob in each direction, at offsets of cells, shape (B, O)."""
    turns = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    middles = DISTANCE * np.stack([np.sin(turns), np.cos(turns)], axis=-1)
    apart = np.sum((offsets() - middles[:, None]) ** 2, axis=-1)
    return np.asarray(np.exp(-apart / (2 * DEVIATION**2)) / (2 * np.pi * DEVIATION**2))


def _surrounded(body: Body) -> Booleans:
    """Return whether a camera pixel's q is far enough from the body's outline, shape (n,)."""
    around = groups()[np.hypot(*offsets().T) <= AROUND]
    return np.asarray(body.covered[:, around].mean(axis=1) > SURROUNDED)


def _terms(body: Body, media: Media, channel: int, shape: Floats, power: Floats) -> _Terms:
    """Fit direct light, kernels and what these have more on one side; and each blob with them."""
    blobs, count = _blobs(), len(body.pixels)
    misfit, of_blobs = np.empty(count), np.empty((4, len(blobs), count))

    def work(batch: slice) -> None:
        some = np.arange(*batch.indices(count))
        unit, responses = body.to_direct[batch], body.responses[batch, channel]
        odd = _odd_kernels(body, media, channel, some)
        terms = np.stack([unit, shape[batch], *odd], axis=1)
        # Few responses may not tell these four apart.
        inverse = np.linalg.pinv(terms @ np.moveaxis(terms / power, 1, 2), hermitian=True)
        found = inverse @ np.matvec(terms / power, responses)[..., None]
        left = responses - np.vecmat(found[..., 0], terms)
        misfit[batch] = np.vecdot(left / power, left)
        for number, light in enumerate(blobs):
            blob = body.to_offsets(light, some)
            weighed = blob / power
            shared = inverse @ np.matvec(terms, weighed)[..., None]
            own = np.vecdot(weighed, blob - np.vecmat(shared[..., 0], terms))
            own = np.maximum(own, LEAST_OWN * np.vecdot(weighed, blob) + np.finfo(float).tiny)
            strength = np.maximum(np.vecdot(weighed, left), 0.0) / own
            direct, amplitude = (found - strength[:, None, None] * shared)[:, :2, 0].T
            of_blobs[:, number, batch] = strength**2 * own, strength, direct, amplitude

    side_by_side(work, blocks(count, BATCH_PIXELS))
    return _Terms(misfit, *of_blobs)


def _odd_kernels(body: Body, media: Media, channel: int, chosen: Integers) -> Floats:
    """Return responses to kernels times the cosine of the angle with each axis, (2, m, R)."""
    down_and_across = offsets().T / np.maximum(np.hypot(*offsets().T), 1.0)
    found = np.empty((2, len(chosen), len(body.frequency)))
    for number in np.unique(media.slope[chosen]):
        here = media.slope[chosen] == number
        drawn = kernel(media.sources[channel], REACH, SLOPES[number]).ravel()
        for one, cosine in zip(found, down_and_across, strict=True):
            one[here] = body.to_offsets(drawn * cosine, chosen[here])
    return found
