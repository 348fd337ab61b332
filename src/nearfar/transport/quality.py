"""How far each camera pixel of a transport can be trusted, by its photos."""

from dataclasses import dataclass

from nearfar.arrays import Booleans, Floats


@dataclass(frozen=True, eq=False)
class Quality:
    """Confidence in the correspondence, and saturation, of each camera pixel.

    Attributes
    ----------
    confidence : ndarray, shape (Cy, Cx), float32
        Confidence in q, between 0 and 1; see `nearfar.Correspondence`.
    saturated : ndarray of bool, shape (Cy, Cx)
        Whether any channel is at full scale under white.
    """

    confidence: Floats
    saturated: Booleans
