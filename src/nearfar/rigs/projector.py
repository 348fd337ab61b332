"""A simulated projector: from 8-bit patterns to the light that leaves the lens."""

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from nearfar.arrays import Floats


class SimulatedProjector(BaseModel):
    """How a simulated projector shows a pattern.

    Attributes
    ----------
    black_level : float
        Light of a black pixel as a share of a white one's.
    gamma : float
        Exponent of the response; 1 is linear.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    black_level: float = Field(default=0.0, ge=0.0, lt=1.0)
    gamma: float = Field(default=1.0, gt=0.0, le=10.0)

    def emit(self, pattern: NDArray[np.uint8]) -> Floats:
        """Return the light of an 8-bit pattern, float32, 1 = white less black."""
        # Full white stays 1 above black, so that relighting keeps its units.
        linear = (pattern.astype(np.float32) / np.float32(255.0)) ** np.float32(self.gamma)
        return np.asarray(linear + np.float32(self.black_level / (1.0 - self.black_level)))
