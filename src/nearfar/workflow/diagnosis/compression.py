"""Photos that were stored as JPEG, told by their levels.

JPEG rounds the discrete cosine transform of each block of 8 x 8 pixels to multiples of whole
numbers: of 1 at high quality, and of so large ones at low quality that most become 0. Once a photo
is decoded, more values of the transforms of its luminance are near whole numbers, or near 0, if
blocks are cut where JPEG cut them than if they are cut anywhere else.

Index convention: luminance is (photos, rows, columns); blocks are (n, 8, 8).
"""

import numpy as np
from scipy.fft import dctn

from nearfar.arrays import Booleans, Floats
from nearfar.capture import Capture
from nearfar.faults.of_photos import Compressed, Spoilt

# Side of a block of JPEG.
BLOCK = 8
# Photos that are looked at, and the rows and columns in their middle.
PHOTOS = 8
SIDE = 128
# Share of values that lie within this of a whole number of levels, if photos have 8 bits.
SHARE_OF_WHOLE = 0.95
NEAR_WHOLE = 0.1
LEVELS = 256
# Weights of luminance in JPEG (ITU-R BT.601).
LUMINANCE = np.array([0.299, 0.587, 0.114])
# Blocks that vary by less than this many levels are near whole numbers anyhow.
LEAST_DEVIATION = 0.5
# Values of transforms that are near 0 are within this of it, in levels.
NEAR_ZERO = 1.0
# How far JPEG's own cut stands out, in standard deviations of the others.
LEAST_DEVIATIONS = 4.5


def find_compression(capture: Capture, counted: Booleans) -> list[Spoilt]:
    """Find photos that were stored as JPEG.

    Parameters
    ----------
    capture : Capture
    counted : ndarray of bool, shape (photos,)
        The photos to choose from.

    Raises
    ------
    UnreadableFileError
        If photos are damaged.
    """
    camera = capture.camera
    rows, columns = (_middle(side) for side in camera)
    every = np.flatnonzero(counted)
    if not len(every):
        return []
    chosen = every[:: max(1, len(every) // PHOTOS)][:PHOTOS]
    photos = np.stack([photo[:, columns] for photo in capture.read(chosen, rows)])
    levels = _in_levels(photos.astype(np.float64))
    if levels is None:
        return []
    luminance = levels @ LUMINANCE if levels.shape[3] == 3 else levels[..., 0]
    nearness = np.array(
        [
            _nearness(luminance[:, down:, across:])
            for down in range(BLOCK)
            for across in range(BLOCK)
        ]
    )
    return [Compressed()] if any(_stands_out(each) for each in nearness.T) else []


def _stands_out(nearness: Floats) -> bool:
    """Return whether the largest value lies far above all others; not if any is unknown."""
    *others, best = np.sort(nearness)
    return bool(best > np.mean(others) + LEAST_DEVIATIONS * np.std(others))


def _middle(side: int) -> slice:
    start = max(0, (side - SIDE) // 2)
    return slice(start, min(side, start + SIDE))


def _in_levels(photos: Floats) -> Floats | None:
    """Return photos in levels of 8 bits; None if they have more."""
    values = np.unique(photos)
    if not 2 < len(values) <= LEVELS:
        return None
    # Full scale is the last of the levels, or the levels are so far apart.
    for step in (1 / (LEVELS - 1), float(np.diff(values).min())):
        distance = np.abs(values / step - np.rint(values / step))
        if np.mean(distance < NEAR_WHOLE) > SHARE_OF_WHOLE:
            return photos / step
    return None


def _nearness(luminance: Floats) -> tuple[float, float]:
    """Return how near the blocks' transforms are to whole numbers, and the share that is near 0.

    The first is 1 if all are whole, and 0 on average if they are arbitrary. NaN if all blocks are
    flat.
    """
    count, height, width = luminance.shape
    down, across = height // BLOCK, width // BLOCK
    blocks = (
        luminance[:, : down * BLOCK, : across * BLOCK]
        .reshape(count, down, BLOCK, across, BLOCK)
        .swapaxes(2, 3)
        .reshape(-1, BLOCK, BLOCK)
    )
    blocks = blocks[blocks.std(axis=(1, 2)) > LEAST_DEVIATION]
    if not len(blocks):
        return np.nan, np.nan
    transforms = dctn(blocks, axes=(1, 2), norm="ortho").reshape(len(blocks), -1)[:, 1:]
    return (
        float(np.cos(2 * np.pi * transforms).mean()),
        float(np.mean(np.abs(transforms) < NEAR_ZERO)),
    )
