"""Pictures of differences, as bright as can be seen, with the factor by which they were made so."""

from collections.abc import Iterable

import numpy as np

from nearfar.arrays import Floats
from nearfar.decibels import ROUNDING

# The factor brings all but this share of the largest values, in percent, to at most full scale.
PERCENTILE_IN_SCALE = 99.5
# A factor is one of these times a power of ten, so that it can be read and compared.
LEADING_DIGITS = (5, 2, 1)
LARGEST_POWER = 6
# Differences below this share of full scale are noise of the arithmetic.
LEAST_DIFFERENCE = 10 ** (-ROUNDING / 20)


def difference_gain(differences: Iterable[Floats]) -> int:
    """Return the factor at which differences are shown: one for all, so that they compare.

    Parameters
    ----------
    differences : iterable of ndarray
        Full scale is 1; signs are ignored.

    Returns
    -------
    int
        1, 2, 5, 10 and so on: the largest at which they stay within full scale, but for single
        pixels. 1 where they are rounding alone.
    """
    highest = max((_highest(values) for values in differences), default=0.0)
    if highest <= LEAST_DIFFERENCE:
        return 1
    factors = (
        digit * 10**power for power in range(LARGEST_POWER, -1, -1) for digit in LEADING_DIGITS
    )
    return next((factor for factor in factors if factor * highest <= 1), 1)


def _highest(values: Floats) -> float:
    return float(np.percentile(np.abs(values), PERCENTILE_IN_SCALE)) if values.size else 0.0
