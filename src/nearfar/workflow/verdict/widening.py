"""The factor by which error bars are widened where check photos contradict them."""

import numpy as np

from nearfar.transport.verdict import LARGEST_WIDENING
from nearfar.workflow.verdict.held_out import HeldOut

# Standard deviation of the error ratio (power of the errors over the expected one) of one check
# pattern about 1, as measured on good captures of simulated scenes. Errors of neighbouring camera
# pixels are alike, so that a pattern counts as one value.
SPREAD = 0.3
# An error ratio that is this many standard deviations above 1 is significant.
SURE_DEVIATIONS = 2.0


def widening_of(held_out: HeldOut) -> float:
    """Return the factor by which the error bars of a transport are widened, at least 1.

    It is the square root of `HeldOut.error_ratio` where that is significantly above 1, else 1.

    Parameters
    ----------
    held_out : HeldOut
    """
    ratio = held_out.error_ratio
    # Written so that NaN, as where no camera pixel is usable, widens nothing.
    if ratio is None or not ratio > 1 + SURE_DEVIATIONS * _deviation(held_out):
        return 1.0
    return min(float(np.sqrt(ratio)), LARGEST_WIDENING)


def _deviation(held_out: HeldOut) -> float:
    """Return the standard deviation of the error ratio where error bars hold."""
    signals = [max(light.pair.signal, 1e-300) for light in held_out.lights]
    noise = sum(
        (light.pair.error_deviation / signal) ** 2
        for light, signal in zip(held_out.lights, signals, strict=True)
    )
    expected = sum(
        (light.expected_error or 0.0) / signal
        for light, signal in zip(held_out.lights, signals, strict=True)
    )
    return float(np.hypot(SPREAD / np.sqrt(len(signals)), np.sqrt(noise) / max(expected, 1e-300)))
