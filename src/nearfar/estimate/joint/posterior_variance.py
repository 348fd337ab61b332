"""Posterior variances of linear functionals h_o o + h_d d + h_n.n + h_f.f of camera pixels' rows.

Given the prior component, o, d and q, the posterior is a Gaussian in the prior's eigenvectors; o, d
and q add their own uncertainty.

Index convention: arrays are (n, channels, ...), n camera pixels or functionals of one of them; r
runs over real responses, w over window entries, i over eigenvectors, g over o, d and shifts of q.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.estimate.joint import nuisance
from nearfar.priors.responses import ResponsePrior


class Functionals(NamedTuple):
    """Linear functionals of rows: one of each camera pixel, or all of one camera pixel.

    Attributes
    ----------
    white : ndarray, shape (n,)
        Weight h of white.
    direct : ndarray, shape (n, 3) or (n, 6)
        h of d, and of d times what q is off down and across; then the same of direct light from a
        second place, if any camera pixel has some.
    near : ndarray, shape (n, W^2) or (1, W^2)
        One for all of them where they are of one camera pixel.
    far : ndarray, shape (n, R)
        Re-centred.
    truncated : ndarray, shape (components,) or (components, n)
        Variance of the part of f that the transport does not hold, at unit prior scale, for each
        prior component.
    """

    white: Floats
    direct: Floats
    near: Floats
    far: Floats
    truncated: Floats


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
    """Return posterior variances for one prior component, (n, channels).

    The state is of one camera pixel for each functional, or of one for all of them.
    """
    squared = (state.scale.astype(np.float64) ** 2)[..., None]
    weight, weight_left = (
        1.0 / (squared * prior.eigenvalues + noise.astype(np.float64)[..., None] ** 2)
        for noise in (state.noise, state.noise_left)
    )
    # In double precision: with little noise, variances are small differences of these.
    near, far = functionals.near.astype(np.float64), functionals.far.astype(np.float64)
    covariance = near @ prior.to_near.T + far @ prior.to_far.T
    # Of each functional with the eigenvectors' weights, at unit prior scale.
    covariance = covariance[:, None]
    before = (
        np.einsum("nw,nw->n", near @ prior.covariance, near)
        + far**2 @ prior.far_variance
        + functionals.truncated
    )
    told = np.sum(squared * weight_left * covariance**2, axis=-1)
    given = squared[..., 0] * (before[:, None] - told)
    per_amplitude = np.matmul(state.amplitude_responses.transpose(0, 2, 1), prior.eigenvectors)[
        :, None
    ]
    # Only the camera pixel's own photos tell o, d and q; neighbours' photos tell of n and f, too.
    weighted, weighted_left = (per_amplitude * one[:, :, None] for one in (weight, weight_left))
    normal = np.matmul(weighted, per_amplitude.transpose(0, 1, 3, 2))
    through_rows = np.matmul(weighted_left, (squared * covariance)[..., None])[..., 0]
    return add_amplitudes(given, normal, through_rows, state, functionals)


def add_amplitudes(
    given: Floats,
    normal: Floats,
    through_rows: Floats,
    state: PixelState,
    functionals: Functionals,
) -> Floats:
    """Return variances with what o, d, q and white's own error add to them, (n, channels).

    Parameters
    ----------
    given : ndarray, shape (n, channels), float64
        Variances of the functionals if o, d and q were known.
    normal : ndarray, shape (n or 1, channels, 4 or 7, 4 or 7), float64
        What photos tell of the amplitudes: their Fisher information.
    through_rows : ndarray, shape (n, channels, 4 or 7), float64
        Derivatives of the means of h_n.n + h_f.f by the amplitudes, negative.
    """
    # Weights of o through white's error, of d and the shifts through direct light.
    shape = given.shape
    own = np.stack(
        [
            -state.share_of_white * functionals.white[:, None],
            *(np.broadcast_to(own[:, None], shape) for own in functionals.direct.T),
        ],
        axis=-1,
    )
    # Less those through n and f, whose means depend on o, d and q.
    gradient = own - through_rows
    solved = nuisance.solve(
        np.broadcast_to(normal, (*gradient.shape, gradient.shape[-1])),
        gradient,
        np.broadcast_to(state.precision, gradient.shape),
    )
    variance = given + np.sum(gradient * solved, axis=-1)
    variance += functionals.white[:, None] ** 2 * state.white_variance
    return np.asarray(np.maximum(variance, 0.0))
