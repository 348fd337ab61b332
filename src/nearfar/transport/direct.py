"""Direct transport: each camera pixel responds to the 2 x 2 projector pixels around q.

A fractional q is the centroid of the direct light, so bilinear weights around it are exact
wherever a camera pixel's direct light stays within two projector pixels on each axis.

Index convention: c runs over camera pixels, row by row; a corner is one of the 2 x 2.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Integers, Size, namespace

# A q closer than this to a whole pixel is rounded to it.
WHOLE_PIXEL_TOLERANCE = 1e-4


class Footprint(NamedTuple):
    """Projector pixels that direct light comes from, flat, and their weights, both (C, 4)."""

    pixels: NDArray[np.int64]
    weights: NDArray[np.float32]


def footprint(correspondence: Floats, projector: Size) -> Footprint:
    """Return the 2 x 2 projector pixels around each q, and their bilinear weights.

    Parameters
    ----------
    correspondence : ndarray, shape (..., 2)
        q as (y, x), NaN where there is no direct light, which gets weights of 0.
    projector : Size

    Returns
    -------
    Footprint
        Weights of a lit pixel sum to 1.
    """
    q = np.asarray(correspondence, dtype=np.float64).reshape(-1, 2)
    lit: Booleans = np.asarray(np.isfinite(q).all(axis=1))
    limit = np.array(projector, dtype=np.float64) - 1
    q = np.clip(np.where(lit[:, None], q, 0.0), 0.0, limit)
    nearest = np.rint(q)
    q = np.where(np.abs(q - nearest) < WHOLE_PIXEL_TOLERANCE, nearest, q)
    low = np.floor(q).astype(np.int64)
    high = np.minimum(low + 1, limit.astype(np.int64))
    part = q - low
    pixels = np.empty((len(q), 4), dtype=np.int64)
    weights = np.empty((len(q), 4), dtype=np.float32)
    for corner, (down, across) in enumerate(((0, 0), (0, 1), (1, 0), (1, 1))):
        y = high[:, 0] if down else low[:, 0]
        x = high[:, 1] if across else low[:, 1]
        pixels[:, corner] = y * projector.width + x
        weight_y = part[:, 0] if down else 1 - part[:, 0]
        weight_x = part[:, 1] if across else 1 - part[:, 1]
        weights[:, corner] = weight_y * weight_x * lit
    return Footprint(pixels, weights)


def look_up(light: Floats, where: Footprint) -> Floats:
    """Return the weighted sum of a light (..., P) over each footprint: shape (..., C)."""
    return np.asarray(np.einsum("...ck,ck->...c", light[..., where.pixels], where.weights))


def look_up_each(responses: Floats, pixels: Integers, weights: Floats) -> Floats:
    """Return the weighted sums of responses (P, R) over footprints, shape (n, R).

    Corners whose weights are all 0 are skipped.

    Parameters
    ----------
    responses : array, shape (P, R)
        Of each projector pixel; one row holds all that a corner needs.
    pixels, weights : arrays, shape (n, 4)
        Of the footprints.
    """
    found: Floats = responses[pixels[:, 0]] * weights[:, :1]
    xp = namespace(responses)
    for corner in range(1, 4):
        if bool(xp.any(weights[:, corner] != 0)):
            found += responses[pixels[:, corner]] * weights[:, corner, None]
    return found


def spread(image: Floats, where: Footprint, projector: Size) -> Floats:
    """Adjoint of `look_up`: scatter an image (C,) over the projector, shape (P,)."""
    values = (where.weights * image[:, None]).ravel()
    summed = np.bincount(where.pixels.ravel(), weights=values, minlength=projector.pixels)
    return np.asarray(summed, dtype=np.float64)


def direct_weights(correspondence: Floats, centres: NDArray[np.int64]) -> Floats:
    """Return the weights of direct light on the 3 x 3 pixels around q, and their derivatives by q.

    Parameters
    ----------
    correspondence : ndarray, shape (n, 2)
        q; NaN where there is no direct light, which gets weights of 0.
    centres : ndarray, shape (n, 2)
        q rounded.

    Returns
    -------
    ndarray, shape (n, 3, 9), float32
        Over the 3 x 3 `FOOTPRINT_OFFSETS`: the bilinear footprint, and its derivatives by q down
        and across; 0 along an axis on which q is whole.
    """
    xp = namespace(correspondence)
    lit = xp.all(xp.isfinite(correspondence), axis=1)
    off = xp.where(lit[:, None], correspondence - centres, 0.0)
    weights = xp.stack([xp.clip(-off, min=0.0), 1 - xp.abs(off), xp.clip(off, min=0.0)], axis=-1)
    sign = xp.sign(off)
    steps = xp.stack([xp.clip(sign, max=0.0), -sign, xp.clip(sign, min=0.0)], axis=-1)
    sides = ((weights, weights), (steps, weights), (weights, steps))
    found = [
        (of_y[:, 0, :, None] * of_x[:, 1, None, :]).reshape((len(off), 9)) for of_y, of_x in sides
    ]
    placed = xp.where(lit[:, None, None], xp.stack(found, axis=1), 0.0)
    weighed: Floats = xp.astype(placed, xp.float32)
    return weighed
