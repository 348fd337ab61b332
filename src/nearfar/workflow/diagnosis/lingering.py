"""Photos that hold light of the pattern before, as of a slow projector or of photos taken too soon.

White is shown again and again, each time after another pattern. Where patterns linger, a photo of
white lacks a share of what its pattern before lacks, and no two photos of white look the same. All
of them must tell the same share.

Index convention: arrays are (whites, rows, columns, channels).
"""

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Integers
from nearfar.faults.of_photos import PatternsLinger
from nearfar.workflow.diagnosis.misfit import Fits

# Fewer photos of white do not tell it from chance. A photo counts if what it lacks, in squares, is
# this share of what the one lacks that lacks most: after black it lacks nothing but lamp.
FEWEST, LEAST_INFORMATION = 3, 0.1
# Share that is told, and over its standard deviation.
LEAST_SHARE, SURE_DEVIATIONS = 0.003, 10.0
# The share by each photo differs by less than this share of it.
LARGEST_DIFFERENCE = 0.5


def find_lingering_patterns(fits: Fits, whites: Integers) -> list[PatternsLinger]:
    """Find whether the photos of white hold light of the pattern before.

    Parameters
    ----------
    fits : Fits
        Of all photos of a capture, in the order in which they were taken.
    whites : ndarray of int
        Numbers of the photos of white, two at least.
    """
    numbers = whites[whites > 0]
    deviation = np.sqrt(fits.variance[numbers])
    white = fits.white / deviation
    effects = _without_gain((fits.relit[numbers - 1] - fits.relit[numbers]) / deviation, white)
    mean = fits.photos[numbers].mean(axis=0)
    differences = _without_gain((fits.photos[numbers] - mean) / deviation, white)
    alone = np.sum(effects**2, axis=(1, 2, 3))
    telling = alone > LEAST_INFORMATION * alone.max()
    if np.count_nonzero(telling) < FEWEST:
        return []
    # What all photos of white have in common is part of their mean.
    effects -= effects.mean(axis=0)
    information = np.maximum(np.sum(effects**2, axis=(1, 2, 3)), 1e-300)
    products = np.sum(effects * differences, axis=(1, 2, 3))
    share = float(products.sum() / information.sum())
    least = max(LEAST_SHARE, SURE_DEVIATIONS * float(information.sum() ** -0.5))
    by_each = products[telling] / information[telling]
    if share < least or np.any(np.abs(by_each - share) > LARGEST_DIFFERENCE * share):
        return []
    return [PatternsLinger(share)]


def _without_gain(pictures: Floats, white: Floats) -> NDArray[np.float64]:
    """Return pictures without what a gain of the lamp, one of each channel, changes in white."""
    exact = pictures.astype(np.float64)
    squares = np.sum(white.astype(np.float64) ** 2, axis=(1, 2), keepdims=True)
    gains = np.sum(exact * white, axis=(1, 2), keepdims=True) / np.maximum(squares, 1e-300)
    return np.asarray(exact - gains * white)
