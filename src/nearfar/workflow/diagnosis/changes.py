"""Effects of causes that change between two photos, fitted to normal equations.

Normal equations are those of `nearfar.workflow.diagnosis.misfit`: matrices (photos, causes, causes)
and vectors (photos, causes).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Integers

# A stay elsewhere takes at least so many photos, and leaves at least as many.
FEWEST_PHOTOS = 4


class Step(NamedTuple):
    """A change between two photos.

    Attributes
    ----------
    explained : float
        Misfit, summed over photos.
    photo : int
        The first photo after it.
    size : ndarray
        Effects after it less those before.
    """

    explained: float
    photo: int
    size: NDArray[np.float64]


class Stay(NamedTuple):
    """A change between two photos that was undone between two later ones.

    Attributes
    ----------
    explained : float
        Misfit, summed over photos.
    photo, until : int
        The first photo after it, and the first one after it was undone.
    """

    explained: float
    photo: int
    until: int


def best_step(
    matrix: NDArray[np.float64], vector: NDArray[np.float64], candidates: Integers
) -> Step:
    """Return the change that explains most, before one of some photos.

    A constant effect is no change, so that the misfit it explains is subtracted: estimates that a
    prior pulls towards 0 look out of focus in all photos.
    """
    matrix, vector = matrix.cumsum(axis=0), vector.cumsum(axis=0)
    unchanged = float(solved(matrix[-1], vector[-1]) @ vector[-1])
    before = vector[candidates - 1]
    after = vector[-1] - before
    of_before = solved(matrix[candidates - 1], before)
    of_after = solved(matrix[-1] - matrix[candidates - 1], after)
    explained = np.sum(of_before * before + of_after * after, axis=1)
    best = int(np.argmax(explained))
    return Step(
        float(explained[best]) - unchanged,
        int(candidates[best]),
        of_after[best] - of_before[best],
    )


def explained_by(
    matrix: NDArray[np.float64], vector: NDArray[np.float64], causes: list[int]
) -> float:
    """Return the misfit that some causes explain together."""
    part = vector[causes]
    return float(part @ solved(matrix[np.ix_(causes, causes)], part))


def solved(matrix: NDArray[np.float64], vector: NDArray[np.float64]) -> NDArray[np.float64]:
    """Solve normal equations, (..., n, n) and (..., n); causes without effect come out as 0."""
    scale = np.sqrt(np.maximum(np.diagonal(matrix, axis1=-2, axis2=-1), 1e-300))
    scaled = matrix / (scale[..., :, None] * scale[..., None, :])
    inverse = np.linalg.pinv(scaled, rcond=1e-9, hermitian=True)
    return np.asarray(np.einsum("...ij,...j->...i", inverse, vector / scale) / scale)


def best_stay(matrix: NDArray[np.float64], vector: NDArray[np.float64]) -> Stay:
    """Return the change that explains most and is undone later.

    Photos whose equations are zero tell nothing. As by `best_step`, the misfit that a constant
    effect explains is subtracted.
    """
    causes = vector.shape[1]
    sums = np.concatenate([np.zeros((1, causes, causes)), matrix.cumsum(axis=0)])
    sums_of_vector = np.concatenate([np.zeros((1, causes)), vector.cumsum(axis=0)])
    photo, until = np.triu_indices(len(sums), FEWEST_PHOTOS)
    elsewhere = until - photo <= len(matrix) - FEWEST_PHOTOS
    inside = (photo > 0) & (until < len(matrix))
    photo, until = photo[elsewhere & inside], until[elsewhere & inside]
    if not len(photo):
        return Stay(0.0, 0, 0)
    whole, whole_vector = sums[-1], sums_of_vector[-1]
    there, there_vector = sums[until] - sums[photo], sums_of_vector[until] - sums_of_vector[photo]
    here_vector = whole_vector - there_vector
    explained = np.sum(solved(there, there_vector) * there_vector, axis=1)
    explained += np.sum(solved(whole - there, here_vector) * here_vector, axis=1)
    unchanged = float(solved(whole, whole_vector) @ whole_vector)
    # Of those that explain as much, as photos at their ends tell nothing, the shortest.
    as_good = np.flatnonzero(explained >= explained.max() * (1 - 1e-9))
    best = int(as_good[np.argmin((until - photo)[as_good])])
    return Stay(float(explained[best]) - unchanged, int(photo[best]), int(until[best]))
