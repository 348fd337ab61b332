"""What else than direct light responds to a frequency: spectra of far- and near-range light.

All amplitudes are shares of a camera pixel's white, so that they hold for any exposure.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from nearfar.arrays import Floats
from nearfar.illumination.real_basis import RealBasis


class Spectrum(Protocol):
    """Expected light that is not direct, by frequency."""

    def spectral_density(self, basis: RealBasis) -> Floats:
        """Return the expected squared response to each frequency, over white, shape (K,)."""
        ...


@dataclass(frozen=True)
class Background:
    """Amplitudes of light that is not direct.

    Attributes
    ----------
    near : float
        Highest entry of near-range light, a Gaussian with the deviation `NEAR_WIDTH`.
    floor : float
        Response at any frequency, to single entries of t that stand out.
    """

    near: float
    floor: float

    def spectral_density(self, basis: RealBasis) -> Floats:
        """Return the expected squared response to each frequency, shape (K,)."""
        cycles = basis.cycles
        around = np.hypot(*(cycles * basis.projector).T)
        far = FAR_AMPLITUDE * np.exp(-around / FAR_DECAY_CYCLES)
        spread = 2 * np.pi * NEAR_WIDTH**2
        near = (
            self.near * spread * np.exp(-0.5 * (2 * np.pi * NEAR_WIDTH * np.hypot(*cycles.T)) ** 2)
        )
        return np.asarray(far**2 + near**2 + self.floor**2)


# Far-range light: amplitude at DC, and cycles across the projector in which it falls to 1/e.
FAR_AMPLITUDE = 0.1
FAR_DECAY_CYCLES = 2.0
# Standard deviation of near-range light in projector pixels.
NEAR_WIDTH = 2.0

# To find the place: weak, so that nearly every response counts.
SEARCH_BACKGROUND = Background(near=0.001, floor=0.003)
# To measure the footprint: strong where low frequencies would add near-range light to it.
FOOTPRINT_BACKGROUND = Background(near=0.04, floor=0.01)
# To decide whether there is direct light: as strong as near-range light may be anywhere.
DETECTION_BACKGROUND = Background(near=0.01, floor=0.03)

# Near-range light of a large projector falls to 1/e in this share of its longer side.
NEAR_REACH = 0.01


@dataclass(frozen=True)
class LargeBackground:
    """Amplitudes of light that is not direct, on a projector that is large in pixels.

    How far near-range light reaches is a share of the screen here, and not a number of pixels.

    Attributes
    ----------
    near : float
        Near-range light, which falls as an exponential by e within `NEAR_REACH`.
    floor : float
        Response at any frequency.
    """

    near: float
    floor: float

    def spectral_density(self, basis: RealBasis) -> Floats:
        """Return the expected squared response to each frequency, shape (K,), float32."""
        cycles = basis.cycles
        around = np.hypot(*(cycles * basis.projector).T)
        far = FAR_AMPLITUDE * np.exp(-around / FAR_DECAY_CYCLES)
        reach = NEAR_REACH * max(basis.projector)
        # The Fourier transform of exp(-r / reach) in two dimensions.
        near = self.near / (1 + (2 * np.pi * reach * np.hypot(*cycles.T)) ** 2) ** 1.5
        return np.asarray(far**2 + near**2 + self.floor**2, dtype=np.float32)


# To find the place, to place it exactly, and to decide whether there is direct light; as above.
LARGE_SEARCH_BACKGROUND = LargeBackground(near=0.05, floor=0.003)
LARGE_FOOTPRINT_BACKGROUND = LargeBackground(near=0.3, floor=0.01)
LARGE_DETECTION_BACKGROUND = LargeBackground(near=1.0, floor=0.03)
