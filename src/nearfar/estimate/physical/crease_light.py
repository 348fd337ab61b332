"""Inter-reflection of camera pixels at creases.

A camera pixel that a crease crosses lights itself, and no pattern tells that light from its direct
light. But inter-reflection grows towards a crease, and changes little along it: a camera pixel at a
crease has no less than most of those around it, and no more than those before and behind it.

Index convention: c runs over camera pixels at creases.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from nearfar.arrays import Booleans, Floats
from nearfar.estimate.physical.around import DIRECTIONS, moved, steps
from nearfar.estimate.physical.creases import NEXT_TO
from nearfar.estimate.physical.elsewhere import Elsewhere
from nearfar.estimate.physical.split import DARK, PhysicalSplit, opaque, with_more_direct

# So many of the eight around may have less inter-reflection.
DARKER = 3
# How far on both sides camera pixels tell which way a crease runs.
LENGTH = 3


def at_creases(split: PhysicalSplit, drawn: Elsewhere) -> Booleans:
    """Return the camera pixels at creases and those next to them, shape (Cy, Cx).

    Parameters
    ----------
    split : PhysicalSplit
    drawn : Elsewhere
        Direct light of camera pixels whose q creases have drawn aside.
    """
    found = np.zeros(split.transport.camera, dtype=bool)
    found.ravel()[drawn.pixels] = True
    return np.asarray(ndimage.binary_dilation(found, NEXT_TO) & opaque(split))


def with_crease_light(split: PhysicalSplit, creases: Booleans) -> PhysicalSplit:
    """Return a split with inter-reflection at creases like that of the camera pixels around.

    Parameters
    ----------
    split : PhysicalSplit
    creases : ndarray of bool, shape (Cy, Cx)

    Returns
    -------
    PhysicalSplit
    """
    if not creases.any():
        return split
    shape = split.transport.direct.shape
    white = np.ones(split.transport.projector, dtype=np.float32)
    parts = [np.reshape(part, shape).astype(np.float64) for part in split.components(white)]
    total = np.maximum(sum(parts), DARK)
    before = parts[2]
    # By itself and as a share of all light: where albedo changes, the two differ.
    floor = np.minimum(
        _around(before, creases)[DARKER], _around(before / total, creases)[DARKER] * total[creases]
    )
    after = before.copy()
    after[creases] = np.maximum(before[creases], floor)
    share = np.where(opaque(split)[..., None], after / total, np.nan)
    along = _direction(creases)[creases]
    ceiling = np.maximum(
        _most_along(np.where(np.isnan(share), np.nan, after), creases, along),
        _most_along(share, creases, along) * total[creases],
    )
    after[creases] = np.minimum(after[creases], ceiling)
    return with_more_direct(split, before - after)


def _around(values: Floats, chosen: Booleans) -> NDArray[np.float64]:
    """Return the eight values around each chosen camera pixel in ascending order, (8, c, channels).

    Beyond the camera's border stands the camera pixel's own.
    """
    found = np.stack([moved(values, step, np.nan)[chosen] for step in steps(1)])
    return np.sort(np.where(np.isnan(found), values[chosen], found), axis=0)


def _direction(creases: Booleans) -> NDArray[np.int64]:
    """Return in which of `DIRECTIONS` the crease through each camera pixel runs, (Cy, Cx)."""
    away = [distance for distance in range(-LENGTH, LENGTH + 1) if distance != 0]
    lengths = [
        np.sum([moved(creases, distance * step, False) for distance in away], axis=0)
        for step in DIRECTIONS
    ]
    return np.asarray(np.argmax(lengths, axis=0))


def _most_along(values: Floats, chosen: Booleans, along: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the greater of the values before and behind each chosen camera pixel, (c, channels).

    Parameters
    ----------
    values : ndarray, shape (Cy, Cx, channels)
        NaN where a camera pixel tells nothing: its neighbour's own value counts there.
    chosen : ndarray of bool, shape (Cy, Cx)
    along : ndarray of int, shape (c,)
        Which of `DIRECTIONS` each chosen camera pixel looks in.
    """
    own = values[chosen]
    found: NDArray[np.float64] = np.empty(own.shape)
    for number, step in enumerate(DIRECTIONS):
        both = np.stack([moved(values, way * step, np.nan)[chosen] for way in (-1, 1)])
        greater = np.where(np.isnan(both), own, both).max(axis=0)
        found = np.where((along == number)[:, None], greater, found)
    return found
