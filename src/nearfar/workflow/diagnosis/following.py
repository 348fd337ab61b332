"""Brightness that follows how bright a pattern is as a whole, as by automatic exposure.

Photos of white are then off beside all others, which looks like a response that is not linear. The
photos of a half-screen and of its inverse tell them apart. A response that bends changes light of
half a level most, which white and black hardly have: a picture and its inverse are off from white
by more than twice as much. Automatic exposure changes both alike, as both are half as bright as
white.
"""

import numpy as np

from nearfar.arrays import Integers
from nearfar.faults.of_light import FollowsPattern
from nearfar.photometry.drift import References
from nearfar.plan.patterns import HalfScreen, Picture
from nearfar.workflow.diagnosis.misfit import PhotoFits

# The sum of the photos of a half-screen and of its inverse, less white, as a share of white; and
# its ratio to the same of pictures. docs/decisions/0114 has what bent responses reach.
SMALLEST_EXCESS, LEAST_OVER_PICTURES = 0.005, 0.75


def find_following_of_pattern(fits: PhotoFits, references: References) -> list[FollowsPattern]:
    """Find whether brightness follows the pattern as a whole.

    Parameters
    ----------
    fits : PhotoFits
        Of these the photos alone are used, not the transport's pictures.
    references : References

    Returns
    -------
    list of FollowsPattern
        One, or none; none if the plan has no half-screens, or no pictures.
    """
    of_halves, of_pictures = (
        np.array(
            [
                _excess(fits, number, inverse, references.whites)
                for number, inverses in fits.inverses.items()
                if isinstance(fits.plan.patterns[number], kind)
                for inverse in inverses
                if inverse > number
            ]
        )
        for kind in (HalfScreen, Picture)
    )
    if not len(of_halves) or not len(of_pictures):
        return []
    half, picture = float(of_halves.mean()), float(of_pictures.mean())
    if abs(half) < SMALLEST_EXCESS or half * np.sign(picture) < LEAST_OVER_PICTURES * abs(picture):
        return []
    return [FollowsPattern(1 / (1 + half) - 1)]


def _excess(fits: PhotoFits, number: int, inverse: int, whites: Integers) -> float:
    """Return the sum of a pattern's photo and its inverse's, less white, as a share of white."""
    weight = 1.0 / (fits.variance[number] + fits.variance[inverse])
    white = fits.photos[whites].mean(axis=0) - fits.black
    beyond = fits.photos[number] + fits.photos[inverse] - 2 * fits.black - white
    power = float(np.sum(weight * white**2, dtype=np.float64))
    return float(np.sum(weight * white * beyond, dtype=np.float64)) / max(power, 1e-300)
