"""The normal distribution, of which false alarms are the tail."""

from nearfar.arrays import Floats


def normal_cdf(values: Floats) -> Floats:
    """Return the probability that a standard normal variable is at most each value.

    SciPy is loaded when this is first called: a plan asks correspondence methods for their patterns
    alone, and comes at once.
    """
    from scipy.special import ndtr

    probabilities: Floats = ndtr(values)
    return probabilities
