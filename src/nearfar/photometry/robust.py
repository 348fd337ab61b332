"""Least squares that is robust to outlying camera pixels.

Index convention: c runs over camera pixels, j over shapes.
"""

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats

REWEIGHTINGS = 15
# Coefficients that change by less, relative to the largest, are final.
CONVERGED = 1e-9
# Standard deviations beyond which a pixel has no weight.
BIWEIGHT_CUTOFF = 4.685
# Eigenvalues of the shapes' Gram matrix below this share of the largest are left out: shapes that
# differ by less than its root could be told apart by noise alone.
LEAST_EIGENVALUE = 1e-3


def robust_fit(shapes: Floats, values: Floats) -> tuple[NDArray[np.float64], float]:
    """Fit values by a sum of shapes, robust to outlying pixels.

    Iteratively reweighted least squares with Tukey's biweight, which gives outliers no weight
    (Holland and Welsch 1977); up to two fifths of the pixels may be outliers. Shapes that are alike
    share their coefficient; that of a shape of zeros is 0.

    Parameters
    ----------
    shapes : ndarray, shape (J, C)
    values : ndarray, shape (C,)

    Returns
    -------
    coefficients : ndarray, shape (J,)
        Of each shape.
    error : float
        Standard deviation of the first coefficient if the others were known.
    """
    size = np.sqrt(np.mean(shapes**2, axis=1)) if values.size else np.zeros(len(shapes))
    if not size.any():
        return np.zeros(len(shapes)), np.inf
    unit = shapes / np.where(size > 0, size, 1.0)[:, None]
    weight, found = np.ones_like(values), np.zeros(len(shapes))
    error = np.inf
    for _ in range(REWEIGHTINGS):
        before, weighted = found, unit * weight
        gram = weighted @ unit.T
        found = np.asarray(
            np.linalg.lstsq(gram, weighted @ values, rcond=LEAST_EIGENVALUE)[0], dtype=float
        )
        off = np.abs(values - found @ unit)
        scale = 1.4826 * np.median(off) + 1e-12
        error = scale / np.sqrt(gram[0, 0])
        if np.abs(found - before).max() <= CONVERGED * np.abs(found).max():
            break
        weight = np.maximum(1.0 - (off / (BIWEIGHT_CUTOFF * scale)) ** 2, 0.0) ** 2
    return np.where(size > 0, found / np.where(size > 0, size, 1.0), 0.0), error / size[0]
