"""Least squares that odd camera pixels do not decide.

Index convention: c runs over camera pixels, j over shapes.
"""

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats

# Rounds of reweighting.
ROUNDS = 15
# Deviations beyond which a pixel has no say.
BISQUARE = 4.685
# Shapes that differ by less than the root of this are one: what parts them would be noise.
ALIKE = 1e-3


def robust_fit(shapes: Floats, values: Floats) -> tuple[NDArray[np.float64], float]:
    """Fit values by a sum of shapes, deaf to pixels that do not belong.

    Least squares, reweighted by Tukey's biweight, which forgets what is far off (Holland and
    Welsch 1977); two fifths of the pixels may be. Shapes that are alike share
    their part; one that is nothing has none.

    Parameters
    ----------
    shapes : ndarray, shape (J, C)
    values : ndarray, shape (C,)

    Returns
    -------
    parts : ndarray, shape (J,)
        How much of each shape.
    error : float
        Standard deviation of the first part, were it alone.
    """
    size = np.sqrt(np.mean(shapes**2, axis=1)) if values.size else np.zeros(len(shapes))
    if not size.any():
        return np.zeros(len(shapes)), np.inf
    unit = shapes / np.where(size > 0, size, 1.0)[:, None]
    weight, found = np.ones_like(values), np.zeros(len(shapes))
    error = np.inf
    for _ in range(ROUNDS):
        weighted = unit * weight
        gram = weighted @ unit.T
        found = np.asarray(np.linalg.lstsq(gram, weighted @ values, rcond=ALIKE)[0], dtype=float)
        off = np.abs(values - found @ unit)
        scale = 1.4826 * np.median(off) + 1e-12
        error = scale / np.sqrt(gram[0, 0])
        weight = np.maximum(1.0 - (off / (BISQUARE * scale)) ** 2, 0.0) ** 2
    return np.where(size > 0, found / np.where(size > 0, size, 1.0), 0.0), error / size[0]
