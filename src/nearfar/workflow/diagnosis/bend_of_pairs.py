"""The bend of the response by photos of patterns and of their inverses, without any estimate.

With a linear response the two photos sum to white, whatever the transport. Where the response
bends by b, so that a photo of the light x reads x + b x (x - w / 2) / s, w white and s the largest
white, the sum is off by -2 b x (w - x) / s.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats
from nearfar.workflow.diagnosis.misfit import PhotoFits


class Bend(NamedTuple):
    """A bend of the response, 0 for none.

    Attributes
    ----------
    size : float
        b.
    deviation : float
        Standard deviation of b, from the noise of the photos.
    """

    size: float
    deviation: float


def bend_of_pairs(fits: PhotoFits) -> Bend | None:
    """Return the bend by the sums of inverse photos; None without any pair.

    Parameters
    ----------
    fits : PhotoFits
        Their relit pictures sum to white, right or wrong.
    """
    scale = float(fits.white.max()) or 1.0
    information = product = 0.0
    for number, inverses in fits.inverses.items():
        for inverse in inverses:
            if inverse < number:
                continue
            effect = _bend_of_sum(fits.relit[number] - fits.black, fits.white, scale)
            weight = 1.0 / (fits.variance[number] + fits.variance[inverse])
            one, other = (fits.photos[i] - fits.relit[i] for i in (number, inverse))
            information += float(np.sum(effect**2 * weight, dtype=np.float64))
            product += float(np.sum(effect * weight * (one + other), dtype=np.float64))
    if not information > 0:
        return None
    return Bend(product / information, float(information**-0.5))


def _bend_of_sum(lit: Floats, white: Floats, scale: float) -> Floats:
    """Return the derivative, by the bend, of what two inverse photos sum to beyond white."""
    return np.asarray(-2.0 * lit * (white - lit) / scale)
