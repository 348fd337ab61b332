"""Whether a set of frequencies determines where direct light comes from.

The score of a place at distance D from the right one lies below the peak by
lost(D) = sum_k w_k (1 - cos 2 pi k.D), where w are the weights of the search. Direct light of share
a of white is mistaken for light from D away with the probability that a normal deviate exceeds
a sqrt(lost / 2). The sum over all D, each weighted by the share of places from which it stays on
the pattern grid, bounds the share of camera pixels with a wrong q.
"""

import numpy as np

from nearfar.correspondence.background import SEARCH_BACKGROUND
from nearfar.correspondence.normal import normal_cdf
from nearfar.errors import InputError
from nearfar.illumination.real_basis import RealBasis

# Noise of a response, and direct light, as shares of the white of a camera pixel.
RESPONSE_NOISE = 0.02
DIRECT_SHARE = 0.2
# Expected wrong places for each right one above which the frequencies are refused.
LARGEST_EXPECTED_WRONG = 0.1


def expected_wrong(basis: RealBasis) -> float:
    """Return the expected number of wrong places that score above the right one, in weak light.

    Parameters
    ----------
    basis : RealBasis
        Frequencies without DC, and the pattern grid.

    Returns
    -------
    float
        0 where the frequencies determine q, half the number of places where they leave it open.
    """
    height, width = basis.projector
    down, across = np.arange(1 - height, height), np.arange(1 - width, width)
    cycles = basis.cycles
    weights = 1.0 / (RESPONSE_NOISE**2 + SEARCH_BACKGROUND.spectral_density(basis))
    waves = np.exp(2j * np.pi * np.outer(down, cycles[:, 0])) * weights
    alike = (waves @ np.exp(2j * np.pi * np.outer(cycles[:, 1], across))).real
    lost = np.maximum(weights.sum() - alike, 0.0)
    mistaken = normal_cdf(-DIRECT_SHARE * np.sqrt(lost / 2))
    mistaken[height - 1, width - 1] = 0.0
    staying = np.outer(1 - np.abs(down) / height, 1 - np.abs(across) / width)
    return float((mistaken * staying).sum())


def require_settled(basis: RealBasis) -> None:
    """Refuse frequencies that leave the place of direct light ambiguous.

    Raises
    ------
    InputError
    """
    if not basis.frequencies or expected_wrong(basis) > LARGEST_EXPECTED_WRONG:
        raise InputError(
            f"the frequencies of the photos, {len(basis.frequencies)} beside DC, leave places on "
            f"the pattern grid of {basis.projector} alike, so that q cannot be found from them: "
            f"plan with a wider far band and more near frequencies, or with stripes."
        )
