"""How a simulated light changes while photos are taken."""

import math

from pydantic import BaseModel, ConfigDict, Field


class SimulatedDrift(BaseModel):
    """A light's drift, as shares of what it is at the first photo.

    Attributes
    ----------
    per_100_photos : float
        Share gained, or lost, over 100 photos.
    swing : float
        Share by which it swings to either side.
    period : float
        Photos from swing to swing.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    per_100_photos: float = 0.0
    swing: float = Field(default=0.0, ge=0.0, le=1.0)
    period: float = Field(default=100.0, gt=0.0)

    def at(self, number: int) -> float:
        """Return the light at photo `number` over that at photo 0; no light is below none."""
        swing = self.swing * math.sin(2 * math.pi * number / self.period)
        return max(0.0, 1.0 + self.per_100_photos * number / 100 + swing)
