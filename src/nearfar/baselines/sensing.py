"""The matrix of compressive light transport: random patterns against Haar wavelets.

Index convention: k runs over K patterns, n over wavelets, i over rows: camera pixels and channels.
"""

from dataclasses import dataclass

import numpy as np

from nearfar.arrays import Booleans, Floats, Size
from nearfar.baselines.haar import haar, inverse_haar


@dataclass(frozen=True, eq=False)
class Sensing:
    """The matrix that all rows share, the column of the means projected out.

    Attributes
    ----------
    projector : Size
    columns : ndarray, shape (P, K), float32
        Wavelets but the first, scaled so that their squares sum to about 1; then zeros.
    mean : ndarray, shape (K,)
        Unit vector along the scaling function's column.
    level : ndarray, shape (P,)
        Overlap of each column with `mean`, to take the wavelets' part out of the mean's
        coefficient.
    gain : float
        Length of the scaling function's column, scaled.
    scale : float
        What responses are divided by.
    """

    projector: Size
    columns: Floats
    mean: Floats
    level: Floats
    gain: float
    scale: float

    def project(self, rows: Floats) -> tuple[Floats, Floats]:
        """Split responses (I, K) into the part that wavelets explain, and that along `mean`."""
        along = (rows @ self.mean) / self.scale
        return (rows / self.scale - along[:, None] * self.mean).astype(np.float32), along

    def pictures(self, coefficients: Floats, along: Floats) -> Floats:
        """Rows t from wavelets' coefficients (I, P), the last unused: (I, Py, Px), float32."""
        wavelets = np.roll(coefficients, 1, axis=1)
        wavelets[:, 0] = (along - coefficients @ self.level) / self.gain
        return inverse_haar(wavelets.reshape(-1, *self.projector).astype(np.float32))


def sense(patterns: Booleans) -> Sensing:
    """Prepare the matrix of random patterns against Haar wavelets."""
    count = len(patterns)
    projector = Size(*patterns.shape[1:])
    scale = float(np.sqrt(count) / 2)
    matrix = haar(patterns.astype(np.float64)).reshape(count, -1).T / scale
    gain = float(np.linalg.norm(matrix[0]))
    mean = matrix[0] / gain
    level = np.append(matrix[1:] @ mean, 0.0)
    columns = np.zeros((projector.pixels, count), dtype=np.float32)
    columns[:-1] = matrix[1:] - level[:-1, None] * mean
    return Sensing(projector, columns, mean, level, gain, scale)
