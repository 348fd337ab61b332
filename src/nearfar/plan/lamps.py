"""Plans for lamps without a neighbourhood: codes that rely on no order of the lamps."""

from typing import NamedTuple

from nearfar.arrays import AnySize, Size, as_size
from nearfar.checks import as_count
from nearfar.errors import PlanError
from nearfar.plan.codes import MOST_PIXELS, code, order_of_codes
from nearfar.plan.model import Plan
from nearfar.plan.patterns import Pattern
from nearfar.plan.references import FEWEST, with_references

# Photos to one white and one black.
PHOTOS_TO_A_REFERENCE = 40
# Share of the photos that are check photos.
CHECKED_SHARE = 0.04


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
    if projector.pixels > MOST_PIXELS:
        raise PlanError(
            f"{projector.pixels} lamps are too many to tell one by one: plan for a grid of at most "
            f"{MOST_PIXELS}, or leave a range in the model."
        )
    references, checks, codes = shares_of_photos(projector, photos, checked=checked)
    if codes < 1:
        raise PlanError(
            f"{photos} photos are too few for two whites, two blacks, a code and one to check by: "
            f"plan with `photos={2 * FEWEST + 2}` or more."
        )
    order = order_of_codes(projector.pixels)
    # Of another order, so that they are like none of those that are estimated from.
    other = order_of_codes(order + 1)
    shown: list[Pattern] = [code(number, order) for number in range(codes)]
    for number in range(checks):
        check = code(number, other).model_copy(update={"purpose": "check"})
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
    left = photos - order_of_codes(projector.pixels)
    if 2 * FEWEST + int(checked) <= left < 2 * references + checks:
        # References first: black's error is in every code.
        references = min(references, (left - int(checked)) // 2)
        checks = min(checks, left - 2 * references)
    return SharesOfPhotos(references, checks, photos - 2 * references - checks)
