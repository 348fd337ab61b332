"""Whether a set of frequencies settles where direct light comes from.

Light from one place responses like light from another, D away, but for
lost(D) = sum_k w_k (1 - cos 2 pi k.D), the depth below its peak of the score that one place
throws on the others (its point spread), the weights w being those of the search. Direct light of
share a of white is taken for light from D away with the probability that a normal deviate exceeds
a sqrt(lost / 2). The sum over all D, each with the share of places from which it stays on the
pattern grid, bounds the share of camera pixels that go wrong.
"""

import numpy as np

from nearfar.correspondence.background import SEARCH
from nearfar.correspondence.normal import normal_cdf
from nearfar.errors import InputError
from nearfar.illumination.real_basis import RealBasis

# Noise of an answer, and direct light, as shares of the white of a camera pixel.
NOISE = 0.02
SHARE = 0.2
# Wrong places for each right one at which the frequencies are refused.
MOST_WRONG = 0.1


def expected_wrong(basis: RealBasis) -> float:
    """Expect how many wrong places look better than the right one, at a weakly lit camera pixel.

    Parameters
    ----------
    basis : RealBasis
        Frequencies without DC, and the pattern grid.

    Returns
    -------
    float
        0 where the frequencies settle q, half the number of places where they say nothing.
    """
    height, width = basis.projector
    down, across = np.arange(1 - height, height), np.arange(1 - width, width)
    cycles = basis.cycles
    weights = 1.0 / (NOISE**2 + SEARCH.power(basis))
    waves = np.exp(2j * np.pi * np.outer(down, cycles[:, 0])) * weights
    alike = (waves @ np.exp(2j * np.pi * np.outer(cycles[:, 1], across))).real
    lost = np.maximum(weights.sum() - alike, 0.0)
    mistaken = normal_cdf(-SHARE * np.sqrt(lost / 2))
    mistaken[height - 1, width - 1] = 0.0
    staying = np.outer(1 - np.abs(down) / height, 1 - np.abs(across) / width)
    return float((mistaken * staying).sum())


def require_settled(basis: RealBasis) -> None:
    """Refuse frequencies that leave places alike.

    Raises
    ------
    InputError
    """
    if not basis.frequencies or expected_wrong(basis) > MOST_WRONG:
        raise InputError(
            f"the frequencies of the photos, {len(basis.frequencies)} beside DC, leave places on "
            f"the pattern grid of {basis.projector} alike and cannot tell where direct light "
            f"comes from: plan with a wider far band and more near frequencies, or with stripes."
        )
