"""The posterior mean of d, n and f for camera pixels of one kind whose windows are whole.

Inside the projector the covariance of the answers is diagonal in the kind's eigenvectors, and the
mean is a product there and one back. Where the border cuts the window, see `cut`.

Index convention: arrays are (n, channels, ...); r runs over real answers, i over eigenvectors, w
over window entries, g over the numbers of `nuisance`.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, product
from nearfar.estimate.joint import nuisance
from nearfar.estimate.joint.pixels import Pixels
from nearfar.estimate.joint.prior import Prior
from nearfar.estimate.matrices import Band


class Found(NamedTuple):
    """Posterior means of a group of camera pixels, photo units.

    Attributes
    ----------
    shared : ndarray, shape (n, channels, 4 + E)
        o, what the references' error adds to the answers; d; by how much q is off down and
        across, times d; and d2 ... of other surfaces.
    near : ndarray, shape (n, channels, W^2)
    far : ndarray, shape (n, channels, R)
        Answers of f, re-centred.
    near_noise : ndarray, shape (n, channels)
        Mean variance of a window entry that the photos' noise causes.
    pull : ndarray, shape (n, channels, W^2)
        Gradient of the log evidence by light at each window entry: what the kind leaves.
    """

    shared: Floats
    near: Floats
    far: Floats
    near_noise: Floats
    pull: Floats


def ratio_of(pixels: Pixels, strength: Floats) -> Floats:
    """(s / sigma)^2 for s as a share of white, shape (n, channels), float64."""
    return np.asarray((strength[:, None] * pixels.white.astype(np.float64) / pixels.noise) ** 2)


def near_noise(pixels: Pixels, prior: Prior, ratio: Floats) -> Floats:
    """Mean variance of a window entry that noise causes, shape (n, channels)."""
    return np.asarray(pixels.noise**2 * np.interp(ratio, prior.ratios, prior.shaken))


def solve_whole(pixels: Pixels, prior: Prior, ratio: Floats, _band: Band) -> Found:
    """Estimate camera pixels of one kind.

    Parameters
    ----------
    pixels : Pixels
    prior : Prior
    ratio : ndarray, shape (n, channels)
        (s / sigma)^2.
    """
    noise = pixels.noise[..., None].astype(np.float32) ** 2
    strong = ratio[..., None].astype(np.float32) * noise
    weight = 1.0 / (strong * prior.levels + noise)
    y = product(pixels.answers, prior.directions)
    turned = nuisance.turned(pixels, prior)
    across = turned.transpose(0, 2, 1)
    normal, right = [], []
    for i in range(y.shape[1]):
        weighed = turned * weight[:, i, None]
        normal.append(np.matmul(weighed, across))
        right.append(np.matmul(weighed, y[:, i, :, None])[..., 0])
    shared = nuisance.solve(
        np.stack(normal, axis=1).astype(np.float64),
        np.stack(right, axis=1).astype(np.float64),
        nuisance.precision(pixels),
    ).astype(np.float32)
    y -= np.matmul(shared, turned)
    y *= weight
    pull = product(y, prior.of_window.T)
    y *= strong
    return Found(
        shared=nuisance.laid_out(shared, pixels),
        near=product(y, prior.to_near) * pixels.inside[:, None],
        far=product(y, prior.to_far),
        near_noise=near_noise(pixels, prior, ratio),
        pull=pull,
    )
