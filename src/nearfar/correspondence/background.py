"""What else than direct light responses a frequency: the power of far- and near-range light.

All amplitudes are shares of a camera pixel's white, so that they hold for any exposure.
"""

from dataclasses import dataclass

import numpy as np

from nearfar.arrays import Floats
from nearfar.illumination.real_basis import RealBasis


@dataclass(frozen=True)
class Background:
    """Amplitudes of light that is not direct.

    Attributes
    ----------
    near : float
        Highest entry of near-range light, a Gaussian of `NEAR_WIDTH`.
    floor : float
        What responds at any frequency: entries of t that stand out by themselves.
    """

    near: float
    floor: float

    def power(self, basis: RealBasis) -> Floats:
        """Return the mean square of the responses to each frequency, shape (K,)."""
        cycles = basis.cycles
        around = np.hypot(*(cycles * basis.projector).T)
        far = FAR * np.exp(-around / FAR_DECAY)
        spread = 2 * np.pi * NEAR_WIDTH**2
        near = (
            self.near * spread * np.exp(-0.5 * (2 * np.pi * NEAR_WIDTH * np.hypot(*cycles.T)) ** 2)
        )
        return np.asarray(far**2 + near**2 + self.floor**2)


# Far-range light: amplitude at DC, and cycles across the projector in which it falls e-fold.
FAR = 0.1
FAR_DECAY = 2.0
# Standard deviation of near-range light's spread, projector pixels.
NEAR_WIDTH = 2.0

# To find the place: nearly every answer counts.
SEARCH = Background(near=0.001, floor=0.003)
# To measure the footprint: low frequencies would mistake near-range light for it.
SHARP = Background(near=0.04, floor=0.01)
# To tell direct light from none: whatever near-range light may do counts against it.
STRONG = Background(near=0.01, floor=0.03)
