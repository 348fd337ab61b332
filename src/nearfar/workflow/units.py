"""Units of a truth: the factor to those of photos, and whether they are others than recorded."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

# A truth whose own best exposure is this many times the recorded one, or a part of it, is in
# other units.
LARGEST_RATIO_OF_EXPOSURES = 1.25


def nearest_factor(known: NDArray[np.float64], found: NDArray[np.float64]) -> float:
    """Return the factor that brings known pictures nearest to those found, by least squares."""
    energy = float(np.vdot(known, known))
    along = float(np.vdot(known, found))
    # Without light in common no factor fits better than another.
    return along / energy if energy > 0 and along > 0 else 1.0


def find_other_units(
    name: str, *, fitted: float, recorded: float, what: str, reached: Callable[[], str]
) -> list[str]:
    """Find whether a truth is in other units than the rig recorded.

    Parameters
    ----------
    name : str
        What the truth is called in the sentence.
    fitted, recorded : float
        Photo units per unit of the truth: what fits best, and what the rig recorded.
    what : str
        What is compared with the truth, with its verb, as "the transport is".
    reached : callable
        Returns in words what the fitted exposure would give; called only where that is said.

    Returns
    -------
    list of str
        A sentence, or nothing.
    """
    if not recorded > 0:
        return []
    ratio = fitted / recorded
    if 1 / LARGEST_RATIO_OF_EXPOSURES < ratio < LARGEST_RATIO_OF_EXPOSURES:
        return []
    return [
        f"{name} is in other units than the rig recorded, or {what} too bright or too dark: "
        f"multiplied by {ratio:.4g} it would give {reached()}; name the transport that was "
        f"photographed, or multiply it."
    ]
