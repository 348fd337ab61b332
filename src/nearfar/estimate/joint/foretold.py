"""Errors of foretold responses: of the whole picture, and of the block where they are largest."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size

# Side of a block in camera pixels.
SIDE_OF_BLOCK = 4


class ErrorsOfForetold(NamedTuple):
    """How far off the responses of a frequency are from what all others foretell.

    Attributes
    ----------
    mean : float
        Mean square of the errors over their expected variance: about 1 if all is well, NaN where no
        camera pixel has direct light.
    local : float
        The same of the block of camera pixels where it is the largest, over what is usual there.
    """

    mean: float
    local: float


def summed_up(squares: Floats, index: NDArray[np.int64], camera: Size) -> list[ErrorsOfForetold]:
    """Sum up the squares of the standardised errors of responses, frequency by frequency.

    Parameters
    ----------
    squares : ndarray, shape (C, R)
        Of each response at each camera pixel; NaN where nothing is foretold.
    index : ndarray of int, shape (R,)
        Place of each response's frequency; of cosine and sine the larger one counts.
    camera : Size
    """
    known: NDArray[np.bool_] = np.all(np.isfinite(squares), axis=1)
    mean = squares[known].mean(axis=0) if known.any() else np.full(squares.shape[1], np.nan)
    of_blocks = means_of_blocks(np.where(known[:, None], squares, 0), known, camera)
    if len(of_blocks):
        usual = np.maximum(1.0, np.median(of_blocks, axis=1, keepdims=True))
        local = np.max(of_blocks / usual, axis=0)
    else:
        local = mean
    return [
        ErrorsOfForetold(*(float(each[index == place].max()) for each in (mean, local)))
        for place in range(index.max(initial=-1) + 1)
    ]


def means_of_blocks(squares: Floats, known: NDArray[np.bool_], camera: Size) -> Floats:
    """Return means over blocks of camera pixels, without those that are hardly known.

    Parameters
    ----------
    squares : ndarray, shape (C, R)
        0 where they are not known.
    known : ndarray of bool, shape (C,)
    camera : Size

    Returns
    -------
    ndarray, shape (blocks, R)
        Of the blocks of which at least half of the camera pixels are known.
    """
    down, across = camera.height // SIDE_OF_BLOCK, camera.width // SIDE_OF_BLOCK

    def summed(values: Floats) -> Floats:
        picture = values.reshape(*camera, -1)[: down * SIDE_OF_BLOCK, : across * SIDE_OF_BLOCK]
        blocks = picture.reshape(down, SIDE_OF_BLOCK, across, SIDE_OF_BLOCK, -1)
        return np.asarray(blocks.sum(axis=(1, 3))).reshape(down * across, -1)

    count = summed(known.astype(np.float32))
    return (summed(squares) / np.maximum(1, count))[count[:, 0] >= SIDE_OF_BLOCK**2 / 2]
