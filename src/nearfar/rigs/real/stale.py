"""Stale photos: those that show the pattern before, all over or in part.

A frame that was displayed twice, was torn, or was photographed before the projector had changed
makes a photo of which all rows, or those above or below the tear, equal those of the photo before,
though the patterns differ there.

Index convention: photos are (Cy, Cx, channels), raw levels; bands are groups of rows.
"""

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import blocks
from nearfar.rigs.real.black_and_white import BlackAndWhite, Levels

MAXIMUM_BANDS = 16
# A band resolves patterns if white and black differ by this many times their variance.
CONTRAST_VARIANCE_RATIO = 100.0
# A band sees direct light where the left half of white and the right differ by this share of white
# less black: light from the scene alone hardly depends on which half is lit.
DIRECT_SHARE = 0.5
# Two patterns differ everywhere if, in each of this many groups of their rows and of their columns,
# at least this share of pixels differs by this many levels.
GROUPS_PER_AXIS = 4
DIFFERING_SHARE = 0.1
DIFFERING_LEVELS = 25
# The camera is too coarse to resolve patterns if at least this many photos, and this share of all,
# only looked stale.
MINIMUM_FALSE_SUSPICIONS = 8
FALSE_SUSPICION_SHARE = 0.25


class StalePhotos:
    """Compares each photo of a shoot with the one before.

    Parameters
    ----------
    levels : BlackAndWhite
        Set it anew where light has changed.
    """

    def __init__(self, levels: BlackAndWhite) -> None:
        self.levels = levels
        self._accepted = self._false_suspicions = 0
        self._is_too_coarse = self._differs_everywhere = False
        self._before: tuple[NDArray[np.uint8], Levels] | None = None
        contrast = (levels.white - levels.black) ** 2
        variance = levels.variance(levels.white) + levels.variance(levels.black)
        self._bands = [
            band
            for band in blocks(len(contrast), max(1, -(-len(contrast) // MAXIMUM_BANDS)))
            if contrast[band].mean() > CONTRAST_VARIANCE_RATIO * variance[band].mean()
        ]

    @property
    def is_too_coarse(self) -> bool:
        """Whether the camera does not resolve patterns, so that photos are no longer suspected."""
        return self._is_too_coarse

    def learn_direct_bands(self, left: Levels, right: Levels) -> None:
        """Choose the rows that see direct light, by photos of the two halves of white."""
        halves = (left.astype(np.float32) - right) ** 2
        contrast = (self.levels.white - self.levels.black) ** 2
        direct = [b for b in self._bands if halves[b].mean() > DIRECT_SHARE**2 * contrast[b].mean()]
        self._bands = direct or self._bands

    def begin_after(self, pattern: NDArray[np.uint8], photo: Levels) -> None:
        """Note what was photographed last: white or a half of it, unlike any pattern everywhere."""
        self._before = (pattern, photo)
        self._differs_everywhere = True

    def accept(self, pattern: NDArray[np.uint8], photo: Levels) -> None:
        """Note a photo that is of its pattern."""
        self._accepted += 1
        self._before = (pattern, photo)
        self._differs_everywhere = False

    def accept_suspect(self) -> None:
        """Note that a photo only looked stale."""
        self._false_suspicions += 1
        many = max(MINIMUM_FALSE_SUSPICIONS, FALSE_SUSPICION_SHARE * self._accepted)
        self._is_too_coarse = self._is_too_coarse or self._false_suspicions >= many

    def suspect(self, pattern: NDArray[np.uint8], photo: Levels) -> str | None:
        """Return in words why the next photo looks stale; None if it does not."""
        if self._before is None or self.is_too_coarse:
            return None
        before, displayed = self._before
        if np.array_equal(before, pattern):
            return None
        everywhere = self._differs_everywhere or _differ_everywhere(before, pattern)
        return self.repeated(displayed, photo, everywhere=everywhere)

    def repeated(self, before: Levels, photo: Levels, *, everywhere: bool = True) -> str | None:
        """Return in words what a photo repeats of the one before; None if it repeats nothing.

        Parameters
        ----------
        before, photo : array
        everywhere : bool
            Whether they should differ everywhere, so that an equal part shows a tear.
        """
        same = [self.levels.is_same_light(before[band], photo[band]) for band in self._bands]
        if not same or not any(same):
            return None
        if all(same):
            return "it is the photo before once more"
        # A tear goes through the whole width: all above it, or all below, is old.
        if everywhere and (same[0] or same[-1]):
            return "part of it is the photo before"
        return None


def _differ_everywhere(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> bool:
    """Return whether two patterns differ in all groups of rows and of columns."""
    differing = np.abs(one.astype(np.int16) - other) > DIFFERING_LEVELS
    return all(
        part.mean() >= DIFFERING_SHARE
        for axis in (0, 1)
        for part in np.array_split(
            differing, min(GROUPS_PER_AXIS, differing.shape[axis]), axis=axis
        )
    )
