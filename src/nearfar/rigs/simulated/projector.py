"""A simulated projector: from 8-bit patterns to the light that leaves the lens."""

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from nearfar.arrays import Floats
from nearfar.rigs.simulated.drift import SimulatedDrift


class SimulatedProjector(BaseModel):
    """How a simulated projector shows a pattern.

    Attributes
    ----------
    black_level : float
        Light of a black pixel as a share of a white one's.
    gamma : float
        Exponent of the response; 1 is linear.
    lamp_drift : SimulatedDrift
        How the lamp changes from photo to photo.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    black_level: float = Field(default=0.0, ge=0.0, lt=1.0)
    gamma: float = Field(default=1.0, gt=0.0, le=10.0)
    lamp_drift: SimulatedDrift = SimulatedDrift()

    def emit(self, pattern: NDArray[np.uint8], number: int = 0) -> Floats:
        """Return the light of an 8-bit pattern at photo `number`, float32.

        1 = white less black, at the first photo.
        """
        # Full white stays 1 above black, so that relighting keeps its units.
        linear = (pattern.astype(np.float32) / np.float32(255.0)) ** np.float32(self.gamma)
        light = linear + np.float32(self.black_level / (1.0 - self.black_level))
        return np.asarray(light * np.float32(self.lamp_drift.at(number)))
