"""The posterior mean of d, n and f for camera pixels of one kind.

Inside the projector the covariance of the answers is diagonal in the kind's eigenvectors, and the
mean is a product there and one back. Where the projector's border cuts the window, entries beyond
it are known to be zero, every camera pixel has a covariance of its own, and the same mean is
found by conjugate gradients, preconditioned by the former.

Index convention: arrays are (n, channels, ...); r runs over real answers, i over eigenvectors, w
over window entries.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats
from nearfar.estimate.joint import nuisance
from nearfar.estimate.joint.pixels import Pixels
from nearfar.estimate.joint.prior import Prior
from nearfar.estimate.matrices import Band

# Steps of conjugate gradients at most, and the share of the error at which they end.
STEPS = 30
SETTLED = 1e-4
# Eigenvectors weaker than this share of the strongest are left out at the border.
NEGLIGIBLE = 1e-7


class Found(NamedTuple):
    """Posterior means of a group of camera pixels, photo units.

    Attributes
    ----------
    shared : ndarray, shape (n, channels, G)
        o, what the references' error adds to the answers; d; and d2 ... of other surfaces.
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
    start = Found._make(values[cut] for values in inner)
    better = _cut(pixels.only(cut), prior, s[cut], band, start)
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


class _Unknowns(NamedTuple):
    """Weights of the eigenvectors, in deviations, and o, d, d2 ..."""

    weights: Floats
    shared: Floats  # (n, channels, G)

    def plus(self, step: Floats, other: "_Unknowns") -> "_Unknowns":
        return _Unknowns(
            self.weights + step[..., None] * other.weights,
            self.shared + step[..., None] * other.shared,
        )

    def dot(self, other: "_Unknowns") -> Floats:
        within = np.sum(self.weights * other.weights, axis=-1, dtype=np.float64)
        return np.asarray(within + np.sum(self.shared * other.shared, axis=-1, dtype=np.float64))


class _Border:
    """The least squares of camera pixels with cut windows, and its preconditioner.

    Answers are those of a window cut from the unit-deviation draws of the prior; everything is
    divided by the noise.
    """

    def __init__(self, pixels: Pixels, prior: Prior, s: Floats, band: Band) -> None:
        kept = prior.levels > NEGLIGIBLE * prior.levels[0]
        self.root = np.sqrt(prior.levels[kept])
        self.to_near = prior.to_near[kept] / self.root[:, None]
        self.to_far = prior.to_far[kept] / self.root[:, None]
        self.directions = prior.directions[:, kept]
        self.inside = pixels.inside[:, None].astype(np.float32)
        self.patterns = band.on_window
        # directions hold sqrt(m) U, U orthogonal over all answers: m is what they weigh.
        self.repeats = np.sum(prior.directions**2, axis=1)
        self.s, self.pixels = s, pixels
        self.precision = 1.0 / pixels.noise[..., None] ** 2
        self.columns = nuisance.columns(pixels)[:, None]
        self.known = nuisance.precision(pixels)
        self._prepare()

    def _prepare(self) -> None:
        turned = np.einsum("ncrg,ri->ncgi", self.columns, self.directions, optimize=True)
        self.diagonal = 1.0 + (self.s * self.root) ** 2 * self.precision
        self.coupling = turned * (self.s * self.root * self.precision)[:, :, None]
        weighed = self.columns * self.repeats[:, None]
        own = np.einsum("ncrg,ncrh->ncgh", weighed, self.columns, optimize=True)
        normal = own * self.precision[..., None] + self.known[..., None] * np.eye(
            self.known.shape[-1]
        )
        normal = normal - np.einsum(
            "ncgi,nchi->ncgh", self.coupling / self.diagonal[:, :, None], self.coupling
        )
        self.inverse = np.linalg.inv(normal.astype(np.float64)).astype(np.float32)

    def rows(self, weights: Floats) -> tuple[Floats, Floats]:
        """Windows and far answers of unit-deviation weights."""
        scaled = self.s * weights
        return (scaled @ self.to_near) * self.inside, scaled @ self.to_far

    def answers(self, unknowns: _Unknowns) -> Floats:
        windows, far = self.rows(unknowns.weights)
        shared = np.sum(self.columns * unknowns.shared[:, :, None], axis=-1)
        return np.asarray(windows @ self.patterns.T + far + shared)

    def adjoint(self, answers: Floats) -> _Unknowns:
        weighed = answers * self.repeats * self.precision
        windows = (weighed @ self.patterns) * self.inside
        weights = self.s * (windows @ self.to_near.T + weighed @ self.to_far.T)
        return _Unknowns(weights, np.sum(self.columns * weighed[..., None], axis=-2))

    def normal(self, unknowns: _Unknowns) -> _Unknowns:
        back = self.adjoint(self.answers(unknowns))
        return _Unknowns(
            back.weights + unknowns.weights, back.shared + self.known * unknowns.shared
        )

    def precondition(self, unknowns: _Unknowns) -> _Unknowns:
        scaled = unknowns.weights / self.diagonal
        left = unknowns.shared - np.sum(self.coupling * scaled[:, :, None], axis=-1)
        shared = np.einsum("ncgh,nch->ncg", self.inverse, left)
        taken = np.sum(self.coupling * shared[..., None], axis=2)
        return _Unknowns((unknowns.weights - taken) / self.diagonal, shared.astype(np.float32))


def _cut(pixels: Pixels, prior: Prior, s: Floats, band: Band, start: Found) -> Found:
    problem = _Border(pixels, prior, s, band)
    zero = np.zeros((*s.shape[:2], len(problem.root)), dtype=np.float32)
    unknowns = _Unknowns(zero, start.shared)
    back = problem.adjoint(pixels.answers - problem.answers(unknowns))
    residual = _Unknowns(back.weights, back.shared - problem.known * start.shared)
    step = problem.precondition(residual)
    power = residual.dot(step)
    first = np.maximum(power, 1e-30)
    for _ in range(STEPS):
        image = problem.normal(step)
        along = (power / np.maximum(step.dot(image), 1e-30)).astype(np.float32)
        unknowns = unknowns.plus(along, step)
        residual = residual.plus(-along, image)
        scaled = problem.precondition(residual)
        new_power = residual.dot(scaled)
        if np.all(new_power <= SETTLED**2 * first):
            break
        step = scaled.plus((new_power / np.maximum(power, 1e-30)).astype(np.float32), step)
        power = new_power
    windows, far = problem.rows(unknowns.weights)
    return Found(unknowns.shared.astype(np.float32), windows, far, start.near_noise)
