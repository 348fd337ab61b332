"""Whether a set of frequencies determines where direct light comes from.

The score of a place at distance D from the right one lies below the peak by
lost(D) = sum_k w_k (1 - cos 2 pi k.D), where w are the weights of the search. Direct light of share
a of white is mistaken for light from D away with the probability that a normal deviate exceeds
a sqrt(lost / 2). The sum over all D, each weighted by the share of places from which it stays on
the pattern grid, bounds the share of camera pixels with a wrong q.
"""

from functools import lru_cache

import numpy as np

from nearfar.arrays import Floats, Integers, blocks
from nearfar.correspondence.background import (
    LARGE_SEARCH_BACKGROUND,
    SEARCH_BACKGROUND,
    Spectrum,
)
from nearfar.correspondence.normal import normal_cdf
from nearfar.correspondence.size import is_coarse_to_fine
from nearfar.errors import InputError
from nearfar.illumination.real_basis import RealBasis

# Noise of a response, and direct light, as shares of the white of a camera pixel.
RESPONSE_NOISE = 0.02
DIRECT_SHARE = 0.2
# Expected wrong places for each right one above which the frequencies are refused.
LARGEST_EXPECTED_WRONG = 0.1
# Places on a large projector this share of a side apart, or less, are no mistake for one another.
SAME_PLACE_SHARE = 1 / 512
# Deviations beyond which a mistake has no probability to speak of.
IMPOSSIBLE_DEVIATIONS = 9.0
# Distances at once.
DISTANCES_AT_ONCE = 2**20


@lru_cache(maxsize=4)
def expected_wrong(basis: RealBasis, pitch: int) -> float:
    """Return the expected number of wrong places that score above the right one, in weak light.

    Parameters
    ----------
    basis : RealBasis
        Frequencies without DC, and the pattern grid.
    pitch : int
        Of the plan.

    Returns
    -------
    float
        0 where the frequencies determine q, half the number of places where they leave it open.
        The last few are cached for other tiles.
    """
    height, width = basis.projector
    coarse_to_fine = is_coarse_to_fine(basis.projector, pitch)
    background: Spectrum = LARGE_SEARCH_BACKGROUND if coarse_to_fine else SEARCH_BACKGROUND
    same = SAME_PLACE_SHARE if coarse_to_fine else 0.0
    weights = 1.0 / (RESPONSE_NOISE**2 + background.spectral_density(basis).astype(np.float64))
    # D and -D are alike, so that D down is enough.
    down, across = np.arange(height), np.arange(1 - width, width)
    of_rows = _waves(basis.cycles[:, 0], down) * np.tile(weights, 2)
    of_columns = _waves(basis.cycles[:, 1], across).T
    of_columns[len(weights) :] *= -1
    staying = 1 - np.abs(across) / width
    total = 0.0
    for rows in blocks(height, DISTANCES_AT_ONCE // len(across)):
        lost = np.maximum(weights.sum() - of_rows[rows] @ of_columns, 0.0)
        deviations = DIRECT_SHARE * np.sqrt(lost / 2)
        right = np.abs(across) <= same * width
        deviations[np.ix_(down[rows] <= same * height, right)] = np.inf
        row, column = np.nonzero(deviations < IMPOSSIBLE_DEVIATIONS)
        mistaken = normal_cdf(-deviations[row, column])
        y = down[rows][row]
        both = np.where(y > 0, 2.0, 1.0)
        total += float((both * mistaken * (1 - y / height) * staying[column]).sum())
    return total


def _waves(cycles: Floats, distances: Floats | Integers) -> Floats:
    """Return cosines and sines at distances along an axis, (D, 2 K)."""
    angle = 2 * np.pi * np.outer(distances, cycles)
    return np.concatenate([np.cos(angle), np.sin(angle)], axis=1)


def require_settled(basis: RealBasis, pitch: int) -> None:
    """Refuse frequencies that leave the place of direct light ambiguous.

    Raises
    ------
    InputError
    """
    if not basis.frequencies or expected_wrong(basis, pitch) > LARGEST_EXPECTED_WRONG:
        raise InputError(
            f"the frequencies of the photos, {len(basis.frequencies)} beside DC, leave places on "
            f"the pattern grid of {basis.projector} alike, so that q cannot be found from them: "
            f"plan with a wider far band and more near frequencies, or with stripes."
        )
