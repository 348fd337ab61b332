"""What could have spoilt a photo: hypotheses, and the misfit that each leaves.

A photo is compared with relit pictures: under its own pattern, turned, under the patterns of other
photos, in part under those, with other colours, or brighter or darker.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from nearfar.arrays import Floats
from nearfar.plan import Plan
from nearfar.plan.checks import is_reference
from nearfar.workflow.diagnosis.misfit import LEAST_IN_SUM, SMALLEST_CHANGE, PhotoFits, mean_white

# A photo is suspect above this misfit, in multiples of the usual one, which is at least 1.
SUSPECT_MISFIT = 4.0
# An explanation leaves at most this share of the misfit: by exposure, and by anything else.
EXPOSURE_SHARE = 0.4
OTHER_SHARE = 0.1
# An explanation that leaves at most this many times the misfit of the best is as good, if simpler.
AS_GOOD = 1.3
# The pattern of a photo so many places away may show in part of another.
TORN_REACH = 3

TURNS: tuple[tuple[str, Callable[[Floats], Floats]], ...] = (
    ("rotated by 180 degrees", lambda picture: picture[::-1, ::-1]),
    ("mirrored left to right", lambda picture: picture[:, ::-1]),
    ("mirrored top to bottom", lambda picture: picture[::-1]),
    ("rotated left by 90 degrees", np.rot90),
    ("rotated right by 90 degrees", lambda picture: np.rot90(picture, -1)),
)


@dataclass(frozen=True)
class Explanation:
    """A hypothesis on how a photo was spoilt, and the misfit that it leaves.

    Attributes
    ----------
    what : str
        "order", "turned", "torn", "interlaced", "colours", "exposure" or "mixed".
    misfit : float
    other : int or None
        Number of the other photo that it is like.
    how : str
        How it is turned.
    gain, offset : float
        Changes of lamp or exposure, and of ambient light.
    share : float
        Of the exposure that was under the pattern of the other photo.
    """

    what: str
    misfit: float
    other: int | None = None
    how: str = ""
    gain: float = 0.0
    offset: float = 0.0
    share: float = 0.0

    def explains(self, misfit: float) -> bool:
        """Return whether it explains a photo whose misfit is so large without it."""
        most = EXPOSURE_SHARE if self.what == "exposure" else OTHER_SHARE
        return misfit >= SUSPECT_MISFIT and self.misfit < most * misfit


def simplest(explanations: list[Explanation]) -> Explanation:
    """Return the first of those that explain a photo about as well as the best."""
    least = min(each.misfit for each in explanations)
    return next(each for each in explanations if each.misfit <= AS_GOOD * least)


def explanations(fits: PhotoFits, plan: Plan, number: int) -> Iterator[Explanation]:
    """Yield what a photo could be; the simplest first."""
    photo, relit = fits.photos[number], fits.relit[number]
    weight = 1 / fits.variance[number]

    def squares(picture: Floats) -> Floats:
        return np.asarray(weight * (photo - picture) ** 2)

    values = photo.size
    for other in range(len(fits.photos)):
        if plan.patterns[other] != plan.patterns[number]:
            yield Explanation("order", float(squares(fits.relit[other]).mean()), other)
    for how, turn in TURNS:
        turned = turn(relit)
        # Of a camera that is not square, a photo on its side has another size.
        if turned.shape == photo.shape:
            yield Explanation("turned", float(squares(turned).mean()), how=how)
    channels = photo.shape[2]
    for order in list(permutations(range(channels)))[1:] if 1 < channels <= 4 else []:
        yield Explanation("colours", float(squares(relit[..., list(order)]).mean()))
    yield exposure_change(fits, number)
    neighbours = [
        other
        for other in range(
            max(0, number - TORN_REACH), min(len(fits.photos), number + TORN_REACH + 1)
        )
        if plan.patterns[other] != plan.patterns[number]
    ]
    own = squares(relit).sum(axis=(1, 2))
    for other in neighbours:
        theirs = squares(fits.relit[other]).sum(axis=(1, 2))
        # Rows up to each are of one pattern, all others of the other.
        above = np.concatenate([[0.0], np.cumsum(theirs - own)])[1:-1]
        if len(above):
            below = (theirs - own).sum() - above
            torn = own.sum() + min(above.min(), below.min())
            yield Explanation("torn", float(torn / values), other)
        odd = np.arange(len(own)) % 2 == 1
        interlaced = min(np.where(odd, own, theirs).sum(), np.where(odd, theirs, own).sum())
        yield Explanation("interlaced", float(interlaced / values), other)
    for other in neighbours:
        if is_reference(plan.patterns[other]):
            # That is another exposure, or other light.
            continue
        change = fits.relit[other] - relit
        by_share = float((weight * change * (photo - relit)).sum())
        share = by_share / max(float((weight * change**2).sum()), 1e-300)
        if SMALLEST_CHANGE <= share <= 1:
            mixed = float(squares(relit + np.float32(share) * change).mean())
            yield Explanation("mixed", mixed, other, share=share)


def exposure_change(fits: PhotoFits, number: int) -> Explanation:
    """Return the change of lamp and ambient light that fits a photo best.

    It explains nothing if it is small; nor if the photo and that of the inverse pattern sum to
    white without it, as then the model is wrong and the light was not.

    Parameters
    ----------
    fits : PhotoFits
    number : int
        Of the photo.
    """
    lit = fits.relit[number] - fits.black
    effects = np.stack([lit.ravel(), np.ones(lit.size, dtype=np.float32)]).astype(np.float64)
    weight = 1 / fits.variance[number].ravel()
    weighted = effects * weight
    # What is left of the photo, and of its sum with that of the inverse pattern.
    differences = [(fits.photos[number] - fits.relit[number]).ravel()]
    for inverse in fits.inverses.get(number, ()):
        differences.append(differences[0] + (fits.photos[inverse] - fits.relit[inverse]).ravel())
    solved, *of_sums = (
        np.linalg.lstsq(weighted @ effects.T, weighted @ difference, rcond=None)[0]
        * [1.0, 1.0 / mean_white(fits)]
        for difference in differences
    )
    rest = differences[0] - (solved * [1.0, mean_white(fits)]) @ effects
    misfit = float((weight * rest**2).mean())
    largest = float(np.abs(solved).max())
    # No exposure takes away more than all light.
    if (
        largest < SMALLEST_CHANGE
        or solved[0] <= -1
        or any(float(np.abs(of_sum).max()) < LEAST_IN_SUM * largest for of_sum in of_sums)
    ):
        misfit = np.inf
    return Explanation("exposure", misfit, gain=float(solved[0]), offset=float(solved[1]))
