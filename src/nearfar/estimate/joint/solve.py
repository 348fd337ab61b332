"""The posterior mean of d, n and f for camera pixels of one kind.

Inside the projector the covariance of the answers is diagonal in the kind's eigenvectors, and the
mean is a product there and one back. Where the projector's border cuts the window, entries beyond
it are known to be zero and every camera pixel has a covariance of its own, which is factored
pixel by pixel: iterations take hundreds of steps to part d from n next to a border.

Index convention: arrays are (n, channels, ...); r runs over real answers, i over eigenvectors, w
over window entries, g over the numbers of `nuisance`.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, blocks
from nearfar.estimate.joint import nuisance
from nearfar.estimate.joint.pixels import Pixels
from nearfar.estimate.joint.prior import Prior
from nearfar.estimate.matrices import Band

# Systems of equations solved at once.
SYSTEMS = 64


class Found(NamedTuple):
    """Posterior means of a group of camera pixels, photo units.

    Attributes
    ----------
    shared : ndarray, shape (n, channels, G)
        o, what the references' error adds to the answers; d; by how much q is off down and
        across, times d; and d2 ... of other surfaces.
    near : ndarray, shape (n, channels, W^2)
    far : ndarray, shape (n, channels, R)
        Answers of f, re-centred.
    near_noise : ndarray, shape (n, channels)
        Mean variance of a window entry that the photos' noise causes.
    """

    shared: Floats
    near: Floats
    far: Floats
    near_noise: Floats


def solve(pixels: Pixels, prior: Prior, strength: Floats, band: Band) -> Found:
    """Estimate camera pixels of one kind.

    Parameters
    ----------
    pixels : Pixels
    prior : Prior
    strength : ndarray, shape (n,)
        s as a share of white.
    band : Band
        The measured frequencies without DC.
    """
    s = (strength[:, None] * pixels.white).astype(np.float32)[..., None]
    whole = pixels.inside.all(axis=1) | ~pixels.lit
    inner = _inside(pixels, prior, s)
    if whole.all():
        return inner
    cut = np.flatnonzero(~whole)
    better = _cut(pixels.only(cut), prior, s[cut], band)
    # What noise does to an entry changes little with the cut.
    better = better._replace(near_noise=inner.near_noise[cut])
    for values, new in zip(inner, better, strict=True):
        values[cut] = new
    return inner


def _inside(pixels: Pixels, prior: Prior, s: Floats) -> Found:
    weight = 1.0 / (s * s * prior.levels + pixels.noise[..., None] ** 2)
    y = pixels.answers @ prior.directions
    # (n, 1, G, R), for all channels.
    turned = np.matmul(nuisance.columns(pixels).transpose(0, 2, 1), prior.directions)[:, None]
    weighed = turned * weight[:, :, None]
    shared = nuisance.solve(
        np.matmul(weighed, turned.transpose(0, 1, 3, 2)).astype(np.float64),
        np.matmul(weighed, y[..., None])[..., 0].astype(np.float64),
        nuisance.precision(pixels),
    ).astype(np.float32)
    left = (y - np.matmul(shared[:, :, None], turned)[:, :, 0]) * weight
    strong = left * (s * s)
    # Variance of an entry: what noise makes of the weights, through squared columns.
    shaken = (s * s * weight * pixels.noise[..., None]) ** 2
    energy = np.sum(prior.to_near**2, axis=1)
    return Found(
        shared=shared,
        near=strong @ prior.to_near * pixels.inside[:, None],
        far=strong @ prior.to_far,
        near_noise=shaken @ energy / prior.to_near.shape[1],
    )


def _cut(pixels: Pixels, prior: Prior, s: Floats, band: Band) -> Found:
    """Posterior means where entries beyond the border are known to be zero."""
    number, channels = pixels.white.shape
    parts: list[tuple[NDArray[np.int64], Found]] = []
    masks, group = np.unique(pixels.inside, axis=0, return_inverse=True)
    # directions hold sqrt(m) U, U orthogonal: m is what the squares of a row add up to.
    repeats = np.sum(prior.directions.astype(np.float64) ** 2, axis=1)
    for place, mask in enumerate(masks):
        patterns = band.on_window.astype(np.float64) * mask
        seen = patterns @ prior.covariance
        covariance = seen @ patterns.T + np.diag(prior.power)
        members = np.flatnonzero(group.ravel() == place)
        for block in blocks(len(members), SYSTEMS):
            chosen = members[block]
            some = pixels.only(chosen)
            squared = s[chosen].astype(np.float64)[..., None] ** 2
            noise = np.diag(1.0 / repeats) * some.noise[..., None, None].astype(np.float64) ** 2
            columns = np.broadcast_to(
                nuisance.columns(some)[:, None],
                (len(chosen), channels, len(repeats), nuisance.KEPT + some.extra),
            )
            right = np.concatenate([some.answers[..., None], columns], axis=-1)
            solved = np.linalg.solve(squared * covariance + noise, right)
            normal = np.matmul(columns.transpose(0, 1, 3, 2), solved)
            shared = nuisance.solve(normal[..., 1:], normal[..., 0], nuisance.precision(some))
            left = solved[..., 0] - np.matmul(solved[..., 1:], shared[..., None])[..., 0]
            left = left * squared[..., 0]
            parts.append(
                (
                    chosen,
                    Found(
                        shared, left @ seen * mask, left * prior.power, np.zeros(shared.shape[:2])
                    ),
                )
            )
    whole = Found._make(
        np.empty((number, *values.shape[1:]), dtype=np.float32) for values in parts[0][1]
    )
    for chosen, found in parts:
        for values, new in zip(whole, found, strict=True):
            values[chosen] = new
    return whole
