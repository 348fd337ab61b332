"""The state of an estimate's posterior at each camera pixel: error bars follow from it."""

from dataclasses import dataclass

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.illumination.frequencies import Frequency
from nearfar.priors.component import PriorComponent


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


def deviation_of_mean(deviations: Floats) -> Floats:
    """Return the standard deviation of a mean over channels with independent errors.

    Parameters
    ----------
    deviations : ndarray, shape (channels, ...)
        Standard deviation of each channel.
    """
    return np.asarray(np.linalg.norm(deviations, axis=0) / len(deviations))
