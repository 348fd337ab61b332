"""How strongly sinusoids modulate a camera pixel, which is bounded where all is linear.

Transport is never negative, so no camera pixel responds to a sinusoid by more than to white. Its
modulation, the response's amplitude over half of what white adds to black, is 1 at most. Above it
the camera or the projector is not linear, or black is clipped.
"""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize_scalar

from nearfar.arrays import Booleans, Floats
from nearfar.errors import InputError

# Modulation above this, ...
LARGEST_MODULATION = 1.05
# ... at more than this share of lit camera pixels, is an alarm.
LARGEST_SHARE_ABOVE = 0.02
# Exponents among which that of a response is searched.
EXPONENT_BOUNDS = (0.2, 5.0)
# Camera pixels that an exponent is fitted to.
SAMPLED_PIXELS = 50_000


def of_pair(cosine: Floats, sine: Floats, black: Floats, white: Floats) -> Floats:
    """Modulation by a cosine and a sine of one frequency, each 0.5 + 0.5 cos or sin.

    Parameters
    ----------
    cosine, sine, black, white : array
        Photos of one shape; white above black.

    Returns
    -------
    array
    """
    middle = (white + black) / 2
    return np.asarray(2 * np.hypot(cosine - middle, sine - middle) / (white - black))


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


def share_above_one(modulation: Floats, lit: Booleans) -> float:
    """Share of lit camera pixels with a modulation that is impossible if all is linear."""
    return float((modulation[lit] > LARGEST_MODULATION).mean()) if lit.any() else 0.0


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
