"""The bend of the response by photos of patterns and of their inverses, without any estimate.

With a linear response the two photos sum to white, whatever the transport. Where the response
bends by b, so that a photo of the light x reads x + b x (x - w / 2) / s, w white and s the largest
white, the sum is off by -2 b x (w - x) / s.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats
from nearfar.workflow.diagnosis.misfit import PhotoFits

# Share of what all pairs tell that a pair tells by itself.
LEAST_INFORMATION = 0.01


class Bend(NamedTuple):
    """A bend of the response, 0 for none.

    Attributes
    ----------
    size : float
        b.
    deviation : float
        Standard deviation of b, from the noise of the photos.
    shared : float
        The least size, of the sign of b, of the pairs by themselves; 0 if one has the other sign,
        or there is but one. A single photo under another exposure bends its own pair alone.
    """

    size: float
    deviation: float
    shared: float = 0.0


def bend_of_pairs(fits: PhotoFits) -> Bend | None:
    """Return the bend by the sums of inverse photos; None without any pair.

    Parameters
    ----------
    fits : PhotoFits
        Their relit pictures sum to white, right or wrong.
    """
    scale = float(fits.white.max()) or 1.0
    pairs: list[tuple[float, float]] = []
    for number, inverses in fits.inverses.items():
        for inverse in inverses:
            if inverse < number:
                continue
            effect = _bend_of_sum(fits.relit[number] - fits.black, fits.white, scale)
            weight = 1.0 / (fits.variance[number] + fits.variance[inverse])
            one, other = (fits.photos[i] - fits.relit[i] for i in (number, inverse))
            pairs.append(
                (
                    float(np.sum(effect**2 * weight, dtype=np.float64)),
                    float(np.sum(effect * weight * (one + other), dtype=np.float64)),
                )
            )
    information, product = np.array(pairs).reshape(-1, 2).sum(axis=0).tolist()
    if not information > 0:
        return None
    size = product / information
    # White and black tell of no bend.
    told = [own / known for known, own in pairs if known > LEAST_INFORMATION * information]
    shared = max(0.0, min(np.sign(size) * own for own in told)) if len(told) > 1 else 0.0
    return Bend(size, float(information**-0.5), float(shared))


def _bend_of_sum(lit: Floats, white: Floats, scale: float) -> Floats:
    """Return the derivative, by the bend, of what two inverse photos sum to beyond white."""
    return np.asarray(-2.0 * lit * (white - lit) / scale)
