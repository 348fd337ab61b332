"""Plans for lamps without a neighbourhood."""

import numpy as np
import pytest
from pydantic import ValidationError

from nearfar.arrays import Size
from nearfar.errors import PlanError
from nearfar.plan import parse_plan
from nearfar.plan.codes import order_of_codes
from nearfar.plan.lamps import plan_lamps, shares_of_photos
from nearfar.plan.patterns import LampCode
from nearfar.plan.references import FEWEST


def _drawn(plan, purpose="direct"):
    """Return the codes of a plan, (codes, P), white = 1."""
    codes = [each for each in plan.patterns if each.purpose == purpose]
    return np.array([code.draw(plan.projector).ravel() / 255 for code in codes])


@pytest.mark.parametrize("size", [Size(1, 11), Size(3, 5), Size(15, 15), Size(64, 1)])
def test_as_many_codes_as_lamps_tell_all_apart_with_the_least_noise(size):
    plan = plan_lamps(size, size.pixels + 30)
    codes = _drawn(plan)
    order = next(each.order for each in plan.patterns if isinstance(each, LampCode))
    design = np.concatenate([np.unique(codes, axis=0), np.zeros((1, size.pixels))])
    with_black = np.concatenate([np.ones((len(design), 1)), design], axis=1)
    variance = np.diag(np.linalg.pinv(with_black) @ np.linalg.pinv(with_black).T)[1:]
    # An S-matrix of the order, whose variance is 4 N / (N + 1)^2, and black besides.
    assert variance.max() < 1.2 * 4 / order + 4 / order**2 * 4


@pytest.mark.parametrize("photos", [6, 20, 61, 300])
def test_a_plan_has_as_many_photos_as_asked_for(photos):
    plan = plan_lamps(Size(4, 9), photos)
    assert len(plan.patterns) == photos
    assert plan.counts["check"] >= 1
    assert plan_lamps(Size(4, 9), photos, checked=False).counts["check"] == 0


def test_half_as_many_codes_tell_as_many_directions():
    plan = plan_lamps(Size(15, 15), 120)
    codes = _drawn(plan)
    singular = np.linalg.svd(codes - codes.mean(axis=0), compute_uv=False)
    assert np.count_nonzero(singular > 0.1 * singular[0]) == len(codes) - 1
    assert 0.45 < codes.mean() < 0.55


def test_no_two_lamps_are_neighbours():
    """Neighbouring lamps are lit together no more often than others."""
    codes = _drawn(plan_lamps(Size(15, 15), 270))
    centred = codes - codes.mean()
    alike = (centred.T @ centred / len(codes)).reshape(15, 15, 15, 15)
    beside = [alike[y, x, y, x + 1] for y in range(15) for x in range(14)]
    apart = [alike[y, x, 14 - y, 14 - x] for y in range(15) for x in range(7)]
    assert abs(np.mean(beside) - np.mean(apart)) < 0.01


def test_a_plan_is_read_as_it_was_written():
    plan = plan_lamps(Size(3, 5), 25)
    assert parse_plan(plan.to_json()) == plan


@pytest.mark.parametrize(("order", "row"), [(13, 0), (15, 0), (7, 0), (19, 19)])
def test_codes_that_there_are_not_are_refused(order, row):
    plan = plan_lamps(Size(3, 5), 25)
    code = LampCode.model_construct(order=order, row=row, kind="lamp code", purpose="direct")
    with pytest.raises(ValidationError):
        type(plan).model_validate(plan.model_dump() | {"patterns": [code.model_dump()]})


@pytest.mark.parametrize(
    ("size", "photos", "says"), [(Size(3, 5), 5, "photos=6"), (Size(65, 65), 90, "too many")]
)
def test_what_cannot_be_planned_gets_a_sentence(size, photos, says):
    with pytest.raises(PlanError, match=says):
        plan_lamps(size, photos)


def test_references_and_checks_leave_room_for_all_codes():
    projector = Size(8, 8)
    needed = order_of_codes(projector.pixels) + 2 * FEWEST + 1
    for photos in range(needed, 2 * needed):
        shares = shares_of_photos(projector, photos, checked=True)
        assert 2 * shares.references + shares.checks + shares.codes == photos
        assert shares.codes >= order_of_codes(projector.pixels)
        assert shares.references >= FEWEST
        assert shares.checks >= 1
