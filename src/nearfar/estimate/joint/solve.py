"""The posterior mean of d, n and f for camera pixels of one kind whose windows are whole.

Inside the projector the covariance of the responses is diagonal in the kind's eigenvectors, and the
mean is a product there and one back. Where the border cuts the window, see `cut`.

Index convention: arrays are (n, channels, ...); r runs over real responses, i over eigenvectors, w
over window entries, g over the numbers of `nuisance`.
"""

from typing import NamedTuple

from nearfar.arrays import Floats, beside, namespace, product
from nearfar.estimate.joint import nuisance
from nearfar.estimate.joint.pixels import Pixels
from nearfar.estimate.joint.prior import Prior
from nearfar.estimate.matrices import Band


class Found(NamedTuple):
    """Posterior means of a group of camera pixels, photo units.

    Attributes
    ----------
    shared : ndarray, shape (n, channels, 4 + E)
        o, what the references' error adds to the responses; d; by how much q is off down and
        across, times d; and d2 ... of other surfaces.
    near : ndarray, shape (n, channels, W^2)
    far : ndarray, shape (n, channels, R)
        Responses of f, re-centred.
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
    xp = namespace(pixels.white)
    ratio: Floats = (strength[:, None] * xp.astype(pixels.white, xp.float64) / pixels.noise) ** 2
    return ratio


def near_noise(pixels: Pixels, prior: Prior, ratio: Floats) -> Floats:
    """Mean variance of a window entry that noise causes, shape (n, channels)."""
    xp = namespace(ratio)
    lowest, highest = float(prior.ratios[0]), float(prior.ratios[-1])
    table, ratios = beside(prior.shaken, ratio), beside(prior.ratios, ratio)
    # The ratios tabulated are half a power of 2 apart.
    within = xp.clip(ratio, lowest, highest)
    step = xp.astype(xp.floor(2 * xp.log2(within / lowest)), xp.int64)
    step = xp.clip(step, 0, len(prior.ratios) - 2)
    share = (within - ratios[step]) / (ratios[step + 1] - ratios[step])
    shaken = table[step] + share * (table[step + 1] - table[step])
    noise: Floats = xp.astype(pixels.noise**2 * shaken, xp.float32)
    return noise


def solve_whole(pixels: Pixels, prior: Prior, ratio: Floats, _band: Band) -> Found:
    """Estimate camera pixels of one kind.

    Parameters
    ----------
    pixels : Pixels
    prior : Prior
    ratio : ndarray, shape (n, channels)
        (s / sigma)^2.
    """
    xp = namespace(pixels.responses)
    noise = xp.astype(pixels.noise[..., None], xp.float32) ** 2
    strong = xp.astype(ratio[..., None], xp.float32) * noise
    weight = 1.0 / (strong * prior.levels + noise)
    y = product(pixels.responses, prior.directions)
    turned = nuisance.turned(pixels, prior)
    across = xp.permute_dims(turned, (0, 2, 1))
    normal, right = [], []
    for i in range(y.shape[1]):
        weighed = turned * weight[:, i, None]
        normal.append(weighed @ across)
        right.append((weighed @ y[:, i, :, None])[..., 0])
    solved = nuisance.solve(
        xp.astype(xp.stack(normal, axis=1), xp.float64),
        xp.astype(xp.stack(right, axis=1), xp.float64),
        nuisance.precision(pixels),
    )
    shared = xp.astype(solved, xp.float32)
    y -= shared @ turned
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
