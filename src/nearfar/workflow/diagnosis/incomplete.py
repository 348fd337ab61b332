"""Photos that were not transferred whole: the rest of them has one value."""

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.faults.of_photos import Spoilt
from nearfar.faults.of_single_photos import PhotosIncomplete

# Columns that a row needs for its values to differ by noise.
FEWEST_COLUMNS = 8
# Share of a photo's rows.
LEAST_ROWS = 0.05


def find_incomplete(photos: Floats, blacks: Integers) -> list[Spoilt]:
    """Find photos with rows of one value, where other photos have rows that vary.

    Parameters
    ----------
    photos : ndarray, shape (photos, rows, columns, channels)
    blacks : ndarray of int
        Numbers of the photos of black.

    Returns
    -------
    list of Spoilt
        Empty, or one.
    """
    if photos.shape[2] < FEWEST_COLUMNS:
        return []
    is_even = np.all(photos == photos[:, :, :1], axis=(2, 3))
    # Light at full scale is even in other photos, too, and black that is clipped in those of black.
    usual = (np.median(is_even, axis=0) > 0) | is_even[blacks].any(axis=0)
    share = np.mean(is_even & ~usual, axis=1)
    odd = np.flatnonzero(share > LEAST_ROWS)
    return [PhotosIncomplete(tuple(odd.tolist()))] if len(odd) else []
