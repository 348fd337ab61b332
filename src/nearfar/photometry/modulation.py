"""How strongly sinusoids modulate a camera pixel: by 1 at most, if all is linear.

Transport is never negative, so no camera pixel responds to a sinusoid by more than to white. Its
modulation, the response's amplitude over half of what white adds to black, is 1 at most. Above it
the camera or the projector is not linear, or black is clipped.
"""

import numpy as np

from nearfar.arrays import Booleans, Floats

# A modulation above this, ...
LARGEST_MODULATION = 1.05
# ... at more than this share of lit camera pixels, is an alarm.
LARGEST_SHARE_ABOVE = 0.02


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


def share_above_one(modulation: Floats, lit: Booleans) -> float:
    """Return the share of lit camera pixels with a modulation impossible in a linear system."""
    return float((modulation[lit] > LARGEST_MODULATION).mean()) if lit.any() else 0.0
