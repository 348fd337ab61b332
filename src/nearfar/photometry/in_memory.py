"""Photos of a plan that are kept in memory."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size
from nearfar.plan import Plan


@dataclass(frozen=True, eq=False)
class PhotosInMemory:
    """Photos in memory, read as from a capture.

    Attributes
    ----------
    plan : Plan
    photos : ndarray, shape (photos, Cy, Cx, channels)
        In the plan's order, as the camera gave them.
    full_scale : float
        Value of full scale.
    """

    plan: Plan
    photos: NDArray[Any]
    full_scale: float

    @property
    def camera(self) -> Size:
        """Height and width of the photos."""
        return Size(*self.photos.shape[1:3])

    @property
    def channels(self) -> int:
        """Channels of the photos."""
        return int(self.photos.shape[3])

    def read(self, indices: Sequence[int], rows: slice) -> Floats:
        """Read photos in photo units, float32, (n, len(rows), Cx, channels)."""
        chosen = self.photos[list(indices)][:, rows]
        return np.asarray(chosen.astype(np.float32) / np.float32(self.full_scale))
