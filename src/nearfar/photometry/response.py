"""Responses of a projector and a camera, fitted to ramps of levels and to pairs of photos."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator
from scipy.optimize import isotonic_regression, nnls

from nearfar.arrays import Floats
from nearfar.errors import InputError
from nearfar.photometry.exposures import Sensor

LEVEL_COUNT = 256
# Rounds of a fit whose weights depend on its result.
REWEIGHTINGS = 8
# Levels that a ramp must have for a response to be fitted.
FEWEST_LEVELS = 5


def fit_response(levels: NDArray[np.integer], light: Floats) -> Floats:
    """Fit a projector's response to a ramp of its levels.

    Isotonic regression makes the light increase with the level, and a monotone cubic interpolates
    between the levels of the ramp.

    Parameters
    ----------
    levels : array, shape (n,)
        Projected levels, 0 and 255 among them; a level may come several times.
    light : array, shape (n,)
        Light of each, in any unit.

    Returns
    -------
    array, shape (256,)
        Light above that of level 0, over that of level 255.

    Raises
    ------
    InputError
        If the ends are missing, levels are few, or light does not rise.
    """
    projected, place = np.unique(levels, return_inverse=True)
    if len(projected) < FEWEST_LEVELS or projected[0] != 0 or projected[-1] != LEVEL_COUNT - 1:
        raise InputError(
            f"a ramp of the levels {projected.tolist()} is too short to fit a response to: project "
            f"{FEWEST_LEVELS} levels or more, 0 and 255 among them."
        )
    weights = np.bincount(place).astype(np.float64)
    mean = np.bincount(place, weights=np.asarray(light, dtype=np.float64)) / weights
    rising = isotonic_regression(mean, weights=weights).x
    if not rising[-1] > rising[0]:
        raise InputError(
            "the ramp's photos do not become brighter with its levels: check that the projector "
            "displays them and the camera sees them."
        )
    share = (rising - rising[0]) / (rising[-1] - rising[0])
    table = PchipInterpolator(projected, share)(np.arange(LEVEL_COUNT))
    table[-1] = 1.0
    return np.maximum.accumulate(np.clip(table, 0.0, 1.0))


def unmix_response(
    levels: NDArray[np.integer], light: Floats, mixing: Floats
) -> NDArray[np.float64]:
    """Fit the response of each primary to a ramp of greys that a colour camera saw.

    Parameters
    ----------
    levels : array, shape (n,)
    light : array, shape (n, channels)
        Light of each grey, above black's.
    mixing : array, shape (channels, 3)
        Light that each primary alone, at its highest level, adds in each channel.

    Returns
    -------
    array, shape (256, 3)

    Raises
    ------
    InputError
        As `fit_response`.
    """
    primaries = np.stack([nnls(mixing, row)[0] for row in np.maximum(light, 0.0)])
    return np.stack([fit_response(levels, column) for column in primaries.T], axis=-1)


class Linearity(NamedTuple):
    """How a camera's levels follow the time it exposes.

    Attributes
    ----------
    black : float
        Level at no exposure at all.
    rate : float
        Levels per second.
    worst : float
        Largest error of the line, as a share of full scale.
    """

    black: float
    rate: float
    worst: float


def fit_linearity(seconds: Floats, levels: Floats, full_scale: float) -> Linearity:
    """Fit a line to the mean levels of a constant light at several exposures.

    Parameters
    ----------
    seconds, levels : array, shape (n,)
        Of at least two exposures; none saturated.
    full_scale : float

    Raises
    ------
    InputError
        If there are fewer than two exposures.
    """
    if len(np.unique(seconds)) < 2:
        raise InputError("a line cannot be fitted to one exposure: take photos at two or more.")
    # Each error counts as a share of its level, so that the short ones place the black level.
    weight = 1.0 / np.sqrt(np.maximum(levels, 1.0))
    system = np.stack([np.ones_like(seconds), seconds], axis=-1)
    (black, rate), *_ = np.linalg.lstsq(system * weight[:, np.newaxis], levels * weight)
    worst = np.abs(system @ (black, rate) - levels).max() / full_scale
    return Linearity(float(black), float(rate), float(worst))


def fit_sensor_noise(means: Floats, variances: Floats, black: float) -> Sensor:
    """Fit read noise and gain to the noise of pairs of photos: variance = read^2 + gain * light.

    Parameters
    ----------
    means, variances : array, shape (n,)
        Of groups of pixels of like light, levels and levels squared.
    black : float
        Black level.
    """
    light = np.maximum(np.asarray(means, dtype=np.float64) - black, 0.0)
    system = np.stack([np.ones_like(light), light], axis=-1)
    # The error of a variance is proportional to its expectation. Weights by the measured variance
    # would favour those that chance made small.
    expected = np.full_like(light, max(float(variances.mean()), 1e-6))
    for _ in range(REWEIGHTINGS):
        weight = 1.0 / expected
        solution, _ = nnls(system * weight[:, np.newaxis], variances * weight)
        expected = np.maximum(system @ solution, 1e-6)
    read, gain = solution
    return Sensor(black, max(float(gain), 1e-9), float(np.sqrt(read)))


def pair_noise(
    one: NDArray[np.generic], other: NDArray[np.generic], full_scale: float, groups: int = 24
) -> tuple[Floats, Floats]:
    """Measure the noise of groups of pixels of like light, from two photos of one light.

    Returns
    -------
    means, variances : array, shape (groups,)
        Levels and levels squared; what is saturated or black clipped is left out.
    """
    first, second = (np.asarray(p, dtype=np.float64).reshape(-1) for p in (one, other))
    mean = (first + second) / 2
    good = (np.maximum(first, second) < 0.98 * full_scale) & (np.minimum(first, second) > 0)
    order = np.flatnonzero(good)[np.argsort(mean[good], kind="stable")]
    means, variances = [], []
    for group in np.array_split(order, groups):
        if len(group) > 1:
            difference = first[group] - second[group]
            means.append(mean[group].mean())
            # The variance is about the group's mean difference, which the lamp's flicker shifts.
            variances.append(difference.var(ddof=1) / 2)
    return np.array(means), np.array(variances)
