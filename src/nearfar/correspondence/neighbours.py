"""Where neighbouring camera pixels expect the direct light of a camera pixel to come from.

On a smooth surface q continues that of the camera pixels beside. A camera pixel whose q does not
may have been placed a period away, or there may be a depth edge. So places are only suggested here:
whoever asks scores them by the camera pixel's own responses, and q is never smoothed.

Index convention: arrays are (Cy, Cx, ...) over the camera; the first axis of several is the side,
in the order of `SIDES`.
"""

import numpy as np

from nearfar.arrays import Booleans, Floats

SIDES = ((-1, 0), (1, 0), (0, -1), (0, 1))
# Rows of the camera on each side that suggestions depend on.
REACH = 2
# Distance in projector pixels, and in steps from one camera pixel to the next, within which places
# agree.
SAME_PIXELS = 1.5
SAME_STEPS = 0.25


def continued(q: Floats) -> tuple[Floats, Floats]:
    """Continue q to each camera pixel from the two beside it on each side.

    Parameters
    ----------
    q : ndarray, shape (Cy, Cx, 2)
        NaN where there is no direct light.

    Returns
    -------
    places : ndarray, shape (4, Cy, Cx, 2)
        The line through the two, or the place of the first where the second has none; NaN where
        the first has none.
    tolerances : ndarray, shape (4, Cy, Cx)
        Distance on each axis, in projector pixels, within which another place agrees.
    """
    height, width = q.shape[:2]
    padded = np.pad(q, ((2, 2), (2, 2), (0, 0)), constant_values=np.nan)

    def beside(y: int, x: int) -> Floats:
        return padded[2 + y : 2 + y + height, 2 + x : 2 + x + width]

    first = np.stack([beside(y, x) for y, x in SIDES])
    step = first - np.stack([beside(2 * y, 2 * x) for y, x in SIDES])
    step = np.where(np.isfinite(step), step, 0.0)
    return first + step, SAME_PIXELS + SAME_STEPS * np.abs(step).max(axis=-1)


def differ(q: Floats, places: Floats, tolerances: Floats) -> Booleans:
    """Return which suggested places are other than q; False where nothing is suggested.

    Parameters
    ----------
    q : ndarray, shape (C, 2)
    places : ndarray, shape (4, C, 2)
    tolerances : ndarray, shape (4, C)

    Returns
    -------
    ndarray of bool, shape (4, C)
    """
    with np.errstate(invalid="ignore"):
        return np.asarray(np.abs(places - q).max(axis=-1) > tolerances)


def agree(q: Floats, places: Floats, tolerances: Floats) -> Booleans:
    """Return which suggested places are the same as q; False where nothing is suggested.

    Parameters and result are those of `differ`.
    """
    with np.errstate(invalid="ignore"):
        return np.asarray(np.abs(places - q).max(axis=-1) <= tolerances)
