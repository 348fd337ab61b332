"""The state of an estimate's posterior at each camera pixel: error bars follow from it."""

from dataclasses import dataclass

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.illumination.frequencies import Frequency
from nearfar.priors.component import PriorComponent

# Beyond this variance ratio, free rows are least squares: what no photo tells has no finite
# variance.
LEAST_SQUARES = np.float32(np.inf)


@dataclass(frozen=True, eq=False)
class Posterior:
    """Prior components, their scales, and the noise of a joint estimate.

    Attributes
    ----------
    prior_components : tuple of PriorComponent
    frequencies : tuple of Frequency
        What was measured, one of each +-k, without DC.
    multiplicity : ndarray, shape (R,), float32
        How often each real response was measured.
    prior_component : ndarray of uint8, shape (Cy, Cx)
        Index into `prior_components`.
    prior_scale : ndarray, shape (Cy, Cx), float32
        Standard deviation of near-range light at q before any photo, as a share of white.
    white : ndarray, shape (Cy, Cx, channels), float32
        Light under white, above 0, photo units.
    offset_noise : ndarray, shape (Cy, Cx, channels), float32
        Standard deviation of the error that the references add to every response.
    light_noise : ndarray, shape (Cy, Cx, channels), float32
        Standard deviation of the response to white.
    share_of_white : ndarray, shape (Cy, Cx, channels), float32
        Mean share of the references' error that is the error of the response to white.
    noise_share : ndarray, shape (Cy, Cx, channels), float32
        Variance of noise that error bars of near- and far-range light count in a measured response,
        as a share of the variance that the transport's `noise` gives; below 1 where neighbours'
        photos lower their errors. Direct light's error bars count all of it.
    """

    prior_components: tuple[PriorComponent, ...]
    frequencies: tuple[Frequency, ...]
    multiplicity: Floats
    prior_component: Integers
    prior_scale: Floats
    white: Floats
    offset_noise: Floats
    light_noise: Floats
    share_of_white: Floats
    noise_share: Floats


@dataclass(frozen=True, eq=False)
class PatternPosterior:
    """Prior components, and variance ratios, of an estimate from photos of any patterns.

    Attributes
    ----------
    prior_components : tuple of PriorComponent
    patterns : ndarray, shape (N, P), float32
        What was shown, levels from 0 to 1.
    prior_component : ndarray of uint8, shape (Cy, Cx)
        Index into `prior_components`.
    variance_ratio : ndarray, shape (Cy, Cx), float32
        Square of the prior scale, in photo units, over the variance of a photo's noise, which is
        that of the transport's `noise`.
    black_deviation : ndarray, shape (Cy, Cx, channels), float32
        Standard deviation of black before the camera pixel's own photos, by its neighbours;
        infinite where nothing is known of it.
    """

    prior_components: tuple[PriorComponent, ...]
    patterns: Floats
    prior_component: Integers
    variance_ratio: Floats
    black_deviation: Floats


@dataclass(frozen=True, eq=False)
class FreePosterior:
    """How far light from each lamp is known, of an estimate of free rows.

    Photos of patterns L (N, P) of lamps are y = b + L t + noise. A row t is m + r: the same m for
    every lamp, of which nothing is known before, and r of variance s^2 each. With b and m taken
    out of the photos, L has singular values S and right singular vectors W. At a variance ratio
    rho = (s / sigma)^2, the variance of l.t is, in units of sigma^2,

        (l.1)^2 v + rho |u|^2 - sum_i (W_i.u)^2 rho^2 S_i^2 / (rho S_i^2 + 1),   u = l - (l.1) a,

    v the variance of m, and a what a lamp adds to the estimate of m; i runs over singular vectors.
    Direct light from lamp q is a number of which nothing is known before either, and adds variance
    of its own.

    Attributes
    ----------
    modes : ndarray, shape (k, P), float32
        W.
    strengths : ndarray, shape (k,), float32
        S, above 0.
    mean : ndarray, shape (P,), float32
        a; 0 where m is 0.
    mean_variance : float
        v.
    gain_errors : ndarray, shape (j, P), float32
        Root of the covariance of the lamps' gains, as shares of the gains: light stages.
    variance_ratio : ndarray, shape (Cy, Cx), float32
        rho; infinite for least squares.
    """

    modes: Floats
    strengths: Floats
    mean: Floats
    mean_variance: float
    gain_errors: Floats
    variance_ratio: Floats


AnyPosterior = Posterior | PatternPosterior | FreePosterior


def deviation_of_mean(deviations: Floats) -> Floats:
    """Return the standard deviation of a mean over channels with independent errors.

    Parameters
    ----------
    deviations : ndarray, shape (channels, ...)
        Standard deviation of each channel.
    """
    return np.asarray(np.linalg.norm(deviations, axis=0) / len(deviations))
