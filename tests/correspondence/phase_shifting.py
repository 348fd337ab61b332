"""Correspondence by phase shifting: fringes of one period, unwrapped by Gray code of cells.

Index convention: positions are in projector pixels along the fringes' axis, any shape.
"""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize_scalar

from nearfar.arrays import Floats
from nearfar.errors import InputError

# Bounds between which the exponent of a response is searched.
EXPONENT_BOUNDS = (0.2, 5.0)
# Camera pixels that an exponent is fitted to.
SAMPLED_PIXELS = 50_000


def of_steps(steps: Floats, phases: Sequence[float]) -> tuple[Floats, Floats]:
    """Phase and modulation by fringes 0.5 + 0.5 cos(x + phase), shifted evenly.

    Parameters
    ----------
    steps : array, shape (n, ...)
        Photos less black; three or more.
    phases : sequence of float
        Of each, in radians, evenly over the circle.

    Returns
    -------
    phase : array
        x, in radians from -pi to pi.
    modulation : array
        Amplitude over mean.

    Raises
    ------
    InputError
        If there are fewer than three, or they are not even.
    """
    rotations = np.exp(-1j * np.asarray(phases))
    if len(phases) < 3 or abs(rotations.sum()) > 1e-6 or abs((rotations**2).sum()) > 1e-6:
        raise InputError(
            f"phases {list(phases)} are not shifted evenly over the circle: give three or more."
        )
    response = np.tensordot(rotations, steps, axes=1)
    mean = steps.mean(axis=0)
    amplitude = 2 / len(phases) * np.abs(response)
    return np.angle(response), amplitude / np.maximum(mean, np.finfo(np.float32).tiny)


def position_in_period(phase: Floats, period: float) -> Floats:
    """Return x within its period, from 0 to `period`, from the phase of cos(2 pi x / period)."""
    return np.asarray(phase / (2 * np.pi) * period % period)


def unwrap(position: Floats, period: float, near: Floats) -> Floats:
    """Choose, of the positions a period apart, the one closest to a rough one.

    Parameters
    ----------
    position : array
        Within the period.
    period : float
    near : array
        Rough position; right if it is less than half a period off.
    """
    return np.asarray(position + np.rint((near - position) / period) * period)


def fit_exponent(steps: Floats) -> float:
    """Find the exponent that makes photos of evenly shifted fringes add up as light does.

    Whatever a camera pixel's phase, the mean light of its steps is half of white. If the response
    is a power of the light, the exponent for which this holds is its inverse.

    Parameters
    ----------
    steps : array, shape (n, ...)
        Photos less black over white less black, of lit camera pixels.

    Returns
    -------
    float
        Light over white = (photo over white) ** exponent; 1 where the response is linear.
    """
    flat = np.clip(steps.reshape(len(steps), -1), 0.0, 1.0)
    chosen = flat[:, :: max(1, flat.shape[1] // SAMPLED_PIXELS)].astype(np.float64)

    def squared_error(exponent: float) -> float:
        return float(np.mean((np.mean(chosen**exponent, axis=0) - 0.5) ** 2))

    return float(minimize_scalar(squared_error, bounds=EXPONENT_BOUNDS, method="bounded").x)
