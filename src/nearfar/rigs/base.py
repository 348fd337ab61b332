"""The interface of a rig: a projector that displays patterns, a camera that photographs them."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Size

Photo = NDArray[np.uint8] | NDArray[np.uint16] | NDArray[np.float32]

# A photo that is lost or wrong is taken up to this often before the rig gives up.
MAXIMUM_TRIES = 6


class Rig(Protocol):
    """A projector and a camera before a scene; a rig knows nothing of transport."""

    @property
    def projector(self) -> Size:
        """Pattern grid."""
        ...

    @property
    def full_scale(self) -> float:
        """Value of a photo that stands for 1 in photo units."""
        ...

    def describe(self) -> dict[str, Any]:
        """Return the settings of the rig that are recorded in a capture, as JSON types."""
        ...

    @property
    def alarms(self) -> Sequence[str]:
        """Faults so far, a sentence each: mended by the rig, or for the user to know."""
        ...

    def conditions(self) -> Mapping[str, float]:
        """Return readings recorded with the last photo, such as temperatures."""
        ...

    def shoot(self, patterns: Iterable[NDArray[np.uint8]], first: int = 0) -> Iterator[Photo]:
        """Display each 8-bit pattern and yield its photo, (Cy, Cx, channels), in order.

        Patterns are (Py, Px), or (Py, Px, 3) of red, green and blue. `first` is the number of the
        first pattern in its plan.
        """
        ...
