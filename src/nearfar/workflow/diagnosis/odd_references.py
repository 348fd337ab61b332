"""Photos of white and black that differ from the others of theirs.

White and black are shown again and again through a capture, and drift is told by how they change.
One of them that is under other light, or has somebody's hand in it, is taken for drift: the photos
about it are changed, and look spoilt in its place. So whites are compared with whites and blacks
with blacks, as they were taken.

Index convention: t runs over the photos of one pattern in order, c over values of a sample.
"""

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Integers
from nearfar.faults.of_light import ExposureChanged
from nearfar.faults.of_photos import Spoilt
from nearfar.faults.of_single_photos import PhotosMisfit
from nearfar.photometry.drift import References

# So many photos of a pattern tell of one of them; fewer could as well be drift.
FEWEST = 4
# Light by which one differs from a line through the others, as a share of white, and in multiples
# of what the others differ from it by; three others lie on a line by chance more often.
LEAST_CHANGE, LEAST_OVER_OTHERS, LEAST_OVER_THREE = 0.01, 10.0, 30.0
# Root mean square by which one differs from the median of the others in some camera pixels, after
# its light is made equal, as a share of white, and over that of the others.
LEAST_DIFFERENCE, LEAST_OVER_NOISE = 0.01, 3.0


def find_odd_references(photos: Floats, references: References) -> list[Spoilt]:
    """Find whites and blacks that differ from the others of theirs.

    Parameters
    ----------
    photos : ndarray, shape (photos, rows, columns, channels)
        All photos of a sample as they were taken, in photo units.
    references : References

    Returns
    -------
    list of Spoilt
        Those under other light, then those that show something else.
    """
    white, black = (photos[numbers].mean(axis=0) for numbers in references)
    light = max(float(np.mean(white - black)), float(np.finfo(np.float32).tiny))
    found: list[Spoilt] = []
    odd: list[int] = []
    for numbers in references:
        if len(numbers) < FEWEST:
            continue
        taken = photos[numbers].reshape(len(numbers), -1).astype(np.float64)
        if (place := _different(taken, light)) is not None:
            odd.append(int(numbers[place]))
        elif (other := _under_other_light(taken.mean(axis=1) / light, numbers)) is not None:
            place, change = other
            is_white = numbers is references.whites
            gain, offset = (change, 0.0) if is_white else (0.0, change)
            found.append(ExposureChanged((int(numbers[place]),), gain, offset))
    return [*found, PhotosMisfit(tuple(sorted(odd)))] if odd else found


def _under_other_light(levels: NDArray[np.float64], numbers: Integers) -> tuple[int, float] | None:
    """Return the place of the one that is not in line with the others, and by how much.

    The first and the last are left alone: a lamp that warms up looks like that.
    """
    found: list[tuple[int, float, float]] = []
    for place in range(1, len(levels) - 1):
        rest = np.arange(len(levels)) != place
        line = np.polynomial.Polynomial.fit(numbers[rest], levels[rest], 1)
        left = levels[rest] - line(numbers[rest])
        spread = float(np.sqrt(np.sum(left**2) / (len(left) - 2)))
        found.append((place, float(levels[place] - line(numbers[place])), spread))
    place, change, spread = min(found, key=lambda each: each[2])
    ratio = LEAST_OVER_OTHERS if len(levels) > FEWEST else LEAST_OVER_THREE
    if abs(change) > max(LEAST_CHANGE, ratio * spread):
        return place, change
    return None


def _different(taken: NDArray[np.float64], light: float) -> int | None:
    """Return the place of the only one (t, c) that differs by more than its light.

    The first and the last are left alone: something may have moved after the one, or before the
    other.
    """
    left = np.empty(len(taken))
    for place, photo in enumerate(taken):
        others = np.median(np.delete(taken, place, axis=0), axis=0)
        design = np.stack([others, np.ones_like(others)], axis=1)
        factors, *_ = np.linalg.lstsq(design, photo, rcond=None)
        left[place] = np.sqrt(np.mean((photo - design @ factors) ** 2)) / light
    least = max(LEAST_DIFFERENCE, LEAST_OVER_NOISE * float(np.median(left)))
    (odd,) = np.nonzero(left > least)
    return int(odd[0]) if len(odd) == 1 and 0 < odd[0] < len(taken) - 1 else None
