"""How much wider error bars must be to hold where check photos contradict them."""

import numpy as np

from nearfar.transport.verdict import LARGEST_WIDENING
from nearfar.workflow.verdict.held_out import HeldOut

# Under one check pattern the power of the errors over that which the error bars expect is 1 but for
# this much, a standard deviation, as good captures of simulated scenes show: the errors of
# neighbouring camera pixels are of one kind, so that a pattern counts as one value.
SPREAD = 0.3
# As many standard deviations above 1 are no chance.
SURE_DEVIATIONS = 2.0


def widening_of(held_out: HeldOut) -> float:
    """Return what the error bars are to be multiplied by, at least 1.

    It is the root of `HeldOut.error_ratio` where that is above 1 by more than chance. Error bars
    are never narrowed.

    Parameters
    ----------
    held_out : HeldOut
    """
    ratio = held_out.error_ratio
    # What is no number, as where no camera pixel is usable, widens nothing.
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
