"""Camera pixels whose values are cut off, at the dark end or at the bright one."""

import numpy as np

from nearfar.arrays import Integers
from nearfar.faults.of_photos import BlackClipped, Spoilt, WhiteClipped
from nearfar.photometry.drift import find_references
from nearfar.workflow.diagnosis.sample import CameraSample

# Share of camera pixels at which all photos of black read the lowest level, and at which all those
# of white read the highest.
BLACK_SHARE, WHITE_SHARE = 0.2, 0.002
# Values of white at the highest level, over those at any of the next levels: without a limit they
# are as many, or fewer.
LEVELS, LEAST_OVER_NEXT = 4, 4.0
# Camera pixels of at least this share of the highest level scatter by more than a level; where they
# do not, so may those of a bright wall read one level.
BRIGHT = 0.7
SCATTERING_SHARE = 0.5


def find_clipped_black(sample: CameraSample) -> list[Spoilt]:
    """Find camera pixels that read the lowest level of all in every photo of black."""
    blacks: Integers = find_references(sample.plan).blacks
    lowest = float(sample.photos.min())
    share = float(np.mean((sample.photos[blacks] <= lowest).all(axis=0)))
    return [BlackClipped(share)] if share > BLACK_SHARE else []


def find_clipped_white(sample: CameraSample) -> list[Spoilt]:
    """Find camera pixels that read the highest level of all in every photo of white.

    What is at full scale is known to be saturated; here it is below.
    """
    whites = sample.photos[find_references(sample.plan).whites]
    levels, counts = np.unique(whites, return_counts=True)
    highest = float(levels[-1])
    if highest >= 1.0 or len(levels) < LEVELS:
        return []
    at_highest = (whites >= highest).all(axis=0)
    share = float(np.mean(at_highest.any(axis=-1)))
    is_limit = counts[-1] > LEAST_OVER_NEXT * counts[-LEVELS:-1].max()
    if not is_limit or share < WHITE_SHARE:
        return []
    bright = ~at_highest & (whites.mean(axis=0) > BRIGHT * highest)
    scatter = np.ptp(whites, axis=0)[bright] > 0
    if not len(scatter) or np.mean(scatter) < SCATTERING_SHARE:
        return []
    return [WhiteClipped(share, highest)]
