"""How near the photos under computed lights come to a wanted picture."""

from collections.abc import Callable
from math import inf, isfinite, log10, sqrt

import numpy as np

from nearfar.arrays import Booleans, Floats
from nearfar.errors import InputError

# Camera pixels further from what is wanted, as a share of its greatest value, are out of reach.
OUT_OF_REACH = 0.05

# Takes a picture (Cy, Cx, channels) and its standard deviation or None, which adds to distance.
Distance = Callable[[Floats, Floats | None], float]


def decibels_below(peak: float, rmse: float) -> float:
    """Return by how many dB a root-mean-square error is below a peak; infinity for no error."""
    return 20 * log10(peak / rmse) if rmse > 0 else inf


def finite_or_none(decibels: float) -> float | None:
    """Return dB for JSON, which has no infinity: None for a perfect match."""
    return decibels if isfinite(decibels) else None


def greatest_wanted(target: Floats, counted: Booleans) -> float:
    """Return the greatest value of a target (Cy, Cx, channels) at camera pixels that count.

    Raises
    ------
    InputError
        If it is not above 0, so that no light is needed anywhere.
    """
    peak = float(target[counted].max())
    if peak <= 0:
        raise InputError(
            "the photo under black is brighter than the wanted picture everywhere, so that no "
            "light is needed: give a larger `scale`, or photograph with less ambient light."
        )
    return peak


def distance_from(target: Floats, counted: Booleans) -> Distance:
    """Return a function of expected photos: their root-mean-square distance from a target.

    Parameters
    ----------
    target : ndarray, shape (Cy, Cx, channels)
    counted : ndarray of bool, shape (Cy, Cx)
        Camera pixels that count.
    """

    def distance(picture: Floats, deviation: Floats | None) -> float:
        noise = 0.0 if deviation is None else np.reshape(deviation, target.shape)[counted] ** 2
        return sqrt(float(np.mean((picture - target)[counted] ** 2 + noise)))

    return distance


def out_of_reach(expected: Floats, target: Floats, peak: float, lit: Booleans) -> Booleans:
    """Return the camera pixels (Cy, Cx) whose expected photo is far from a target, or not lit."""
    far = np.abs(expected - target).max(axis=2) > OUT_OF_REACH * peak
    return np.asarray(far | ~lit)


def without_single_channel(values: Floats) -> Floats:
    """Return (y, x) of values (y, x, 1), and others as they are."""
    return values[..., 0] if values.shape[2] == 1 else values
