"""Posterior variances of linear functionals h_o o + h_d d + h_n.n + h_f.f of camera pixels' rows.

Given the prior component, o, d and q, the posterior is a Gaussian in the prior's eigenvectors; o, d
and q add their own uncertainty.

Index convention: arrays are (n, channels, ...), n camera pixels; k runs over functionals of each of
them, r over real responses, w over window entries, i over eigenvectors, g over o, d and shifts of
q.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, Integers, product
from nearfar.estimate.joint import nuisance
from nearfar.priors.responses import ResponsePrior


class Functionals(NamedTuple):
    """Linear functionals of rows, k of each camera pixel.

    Attributes
    ----------
    white : ndarray, shape (n, k)
        Weight h of white.
    direct : ndarray, shape (n, k, 3) or (n, k, 6)
        h of d, and of d times what q is off down and across; then the same of direct light from a
        second place, if any camera pixel has some.
    near : ndarray, shape (n, k, W^2) or (n, 1, W^2)
        One for all of a camera pixel's where they are the same.
    far : ndarray, shape (n, k, R)
        Re-centred.
    truncated : ndarray, shape (components, k) or (components, 1)
        Variance of the part of f that the transport does not hold, at unit prior scale, for each
        prior component.
    """

    white: Floats
    direct: Floats
    near: Floats
    far: Floats
    truncated: Floats

    def only(self, selected: Integers) -> "Functionals":
        """Return those of some of the camera pixels."""
        return Functionals._make((*(part[selected] for part in self[:-1]), self.truncated))


class PixelState(NamedTuple):
    """The posterior's state at camera pixels, the transport's own units."""

    amplitude_responses: Floats  # (n, R, 4 or 7), to unit o, d and shifts
    precision: Floats  # (n, channels, 4 or 7), of the same before any photo
    noise: Floats  # (n, channels), which counts for o, d and q
    noise_left: Floats  # (n, channels), which counts for n and f given o, d and q
    scale: Floats  # prior scale s in photo units, (n, channels)
    white_variance: Floats  # of white's error given o, (n, channels)
    share_of_white: Floats  # (n, channels)
    prior_component: Integers  # (n,)

    def only(self, selected: Integers) -> "PixelState":
        """Return the state at some of the camera pixels."""
        return PixelState._make(values[selected] for values in self)


def posterior_variance(prior: ResponsePrior, state: PixelState, functionals: Functionals) -> Floats:
    """Return posterior variances for one prior component, (n, k, channels).

    `functionals.truncated` is that of the component, (k,) or (1,).
    """
    squared = state.scale.astype(np.float64) ** 2
    weight, weight_left = (
        1.0 / (squared[..., None] * prior.eigenvalues + noise.astype(np.float64)[..., None] ** 2)
        for noise in (state.noise, state.noise_left)
    )
    # In double precision: with little noise, variances are small differences of these.
    near, far = functionals.near.astype(np.float64), functionals.far.astype(np.float64)
    # Of each functional with the eigenvectors' weights, at unit prior scale.
    covariance = product(near, prior.to_near.T) + product(far, prior.to_far.T)
    before = (
        np.einsum("nkw,nkw->nk", product(near, prior.covariance), near)
        + far**2 @ prior.far_variance
        + functionals.truncated
    )
    by_functional = covariance.transpose(0, 2, 1)
    told = squared[..., None] * (weight_left @ by_functional**2)
    given = squared[..., None] * (before[:, None] - told)
    per_amplitude = np.matmul(state.amplitude_responses.transpose(0, 2, 1), prior.eigenvectors)[
        :, None
    ]
    # Only the camera pixel's own photos tell o, d and q; neighbours' photos tell of n and f, too.
    weighted, weighted_left = (per_amplitude * one[:, :, None] for one in (weight, weight_left))
    normal = np.matmul(weighted, per_amplitude.transpose(0, 1, 3, 2))
    through_rows = squared[..., None, None] * np.matmul(weighted_left, by_functional[:, None])
    return add_amplitudes(given, normal, through_rows, state, functionals)


def add_amplitudes(
    given: Floats,
    normal: Floats,
    through_rows: Floats,
    state: PixelState,
    functionals: Functionals,
) -> Floats:
    """Return variances with what o, d, q and white's own error add to them, (n, k, channels).

    Parameters
    ----------
    given : ndarray, shape (n, channels, k), float64
        Variances of the functionals if o, d and q were known.
    normal : ndarray, shape (n, channels, 4 or 7, 4 or 7), float64
        What photos tell of the amplitudes: their Fisher information.
    through_rows : ndarray, shape (n, channels, 4 or 7, k), float64
        Derivatives of the means of h_n.n + h_f.f by the amplitudes, negative.
    """
    # Weights of o through white's error, of d and the shifts through direct light.
    own = np.empty_like(through_rows)
    own[:, :, 0] = -state.share_of_white[..., None] * functionals.white[:, None]
    own[:, :, 1:] = functionals.direct.transpose(0, 2, 1)[:, None]
    # Less those through n and f, whose means depend on o, d and q.
    gradient = own - through_rows
    solved = np.linalg.solve(nuisance.regularised(normal, state.precision), gradient)
    variance = given + np.sum(gradient * solved, axis=2)
    variance += functionals.white[:, None] ** 2 * state.white_variance[..., None]
    return np.asarray(np.maximum(variance, 0.0).transpose(0, 2, 1))
