"""What the photos tell of how far each camera pixel is to be trusted."""

from dataclasses import dataclass

from nearfar.arrays import Booleans, Floats


@dataclass(frozen=True, eq=False)
class Quality:
    """Seen while a transport was reconstructed, and kept with it.

    Attributes
    ----------
    confidence : ndarray, shape (Cy, Cx), float32
        Of the correspondence, between 0 and 1; see `nearfar.Correspondence`.
    saturated : ndarray of bool, shape (Cy, Cx)
        Whether a channel is at full scale under white.
    """

    confidence: Floats
    saturated: Booleans
