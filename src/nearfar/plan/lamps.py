"""Plans for lamps without a neighbourhood: codes that rely on no order of the lamps."""

from itertools import count
from typing import NamedTuple

from nearfar.arrays import AnySize, Size, as_size
from nearfar.checks import as_count
from nearfar.errors import PlanError
from nearfar.illumination import patterns
from nearfar.plan.model import Plan
from nearfar.plan.patterns import LampCode, Pattern
from nearfar.plan.references import FEWEST, with_references

# Lamps of which photos can be turned into rows.
MOST_LAMPS = 4096
# Photos to one white and one black.
PHOTOS_TO_A_REFERENCE = 40
# Share of the photos that are check photos.
CHECKED_SHARE = 0.04
# Share of the order from one row to the next: few photos are of rows that lie far apart.
STEP = 0.382


def plan_lamps(projector: AnySize, photos: int, *, checked: bool = True) -> Plan:
    """Plan photos of lamps that have no neighbours, such as the lamps of a light stage.

    Each photo shows about half of the lamps. As many codes as lamps, and black, tell every lamp
    apart with the least noise that photos of one brightness can; fewer tell as much as they can of
    lamps that are all alike before. No code relies on neighbouring lamps to be alike.

    Parameters
    ----------
    projector : Size or (height, width)
        Lamps, in rows and columns; their order is of no consequence.
    photos : int
        All photos, whites, blacks and check photos included.
    checked : bool
        Whether there are check photos, of other codes, from which nothing is estimated.

    Returns
    -------
    Plan
        With references; `nearfar.workflow.free_rows` makes a transport of its photos.

    Raises
    ------
    PlanError
        If the lamps are too many or the photos too few.
    InputError
        If the size or the photos are not whole numbers.
    """
    projector, photos = as_size(projector, "projector"), as_count(photos, "photos")
    if projector.pixels > MOST_LAMPS:
        raise PlanError(
            f"{projector.pixels} lamps are too many to tell one by one: plan for a grid of at most "
            f"{MOST_LAMPS}, or leave a range in the model."
        )
    references, checks, codes = shares_of_photos(projector, photos, checked=checked)
    if codes < 1:
        raise PlanError(
            f"{photos} photos are too few for two whites, two blacks, a code and one to check by: "
            f"plan with `photos={2 * FEWEST + 2}` or more."
        )
    order = _order_from(projector.pixels)
    # Of another order, so that they are like none of those that are estimated from.
    other = _order_from(order + 1)
    shown: list[Pattern] = [LampCode(order=order, row=_row(row, order)) for row in range(codes)]
    for number in range(checks):
        check = LampCode(order=other, row=_row(number, other), purpose="check")
        shown.insert((2 * number + 1) * len(shown) // (2 * checks), check)
    one = Size(1, 1)
    return Plan(
        projector=projector,
        window=1,
        far=one,
        dropped=one,
        offset="reference",
        correspondence="none",
        patterns=with_references(shown, references, references),
    )


def photos_of_every_code(projector: Size, *, checked: bool = True) -> int | None:
    """Return the fewest photos whose plan shows as many codes as tell every lamp apart.

    All codes of an order do so with the least noise; if a few are left out, some sums of lamps
    remain unknown, or nearly so. None for more lamps than can be planned for.
    """
    if projector.pixels > MOST_LAMPS:
        return None
    return _order_from(projector.pixels) + 2 * FEWEST + int(checked)


class SharesOfPhotos(NamedTuple):
    """How many photos of each sort a plan for lamps has."""

    references: int  # of white, and as many of black
    checks: int
    codes: int


def shares_of_photos(projector: Size, photos: int, *, checked: bool) -> SharesOfPhotos:
    """Return how many of its photos a plan for lamps gives to white and black, checks and codes.

    References and check photos leave room for all codes as long as two whites, two blacks and one
    check photo remain.
    """
    references = max(FEWEST, round(photos / PHOTOS_TO_A_REFERENCE))
    checks = max(1, round(CHECKED_SHARE * photos)) if checked else 0
    left = photos - _order_from(projector.pixels)
    if 2 * FEWEST + int(checked) <= left < 2 * references + checks:
        # References first: black's error is in every code.
        references = min(references, (left - int(checked)) // 2)
        checks = min(checks, left - 2 * references)
    return SharesOfPhotos(references, checks, photos - 2 * references - checks)


def _row(number: int, order: int) -> int:
    return number * max(1, round(STEP * order)) % order


def _order_from(least: int) -> int:
    """Return the smallest order of codes that is at least as large."""
    return next(
        order for order in count(max(3, least)) if order % 4 == 3 and patterns.is_prime(order)
    )
