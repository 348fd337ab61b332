"""Photos in reverse, late or early are told by their brightness."""

import numpy as np
import pytest

from nearfar import choose_plan
from nearfar.arrays import Size
from nearfar.workflow.diagnosis.sequence import _brightness, find_other_order


@pytest.fixture(scope="module")
def plan():
    return choose_plan(Size(16, 16), 60)[0]


@pytest.fixture
def photos(plan):
    """Photos of a scene whose brightness follows the pattern's, roughly."""
    generator = np.random.default_rng(0)
    levels = np.array([plan.draw(n).mean() / 255 for n in range(len(plan.patterns))])
    levels = 0.1 + 0.6 * (levels + 0.05 * generator.standard_normal(len(levels)))
    return np.broadcast_to(levels[:, None, None, None], (len(levels), 8, 8, 1)).copy()


def test_the_order_of_the_plan_is_not_accused(plan, photos):
    assert find_other_order(photos, plan) == []
    # Nor where all photos are alike, or two are swapped.
    assert find_other_order(np.ones_like(photos), plan) == []
    photos[[5, 30]] = photos[[30, 5]]
    assert find_other_order(photos, plan) == []


def test_brightness_is_that_of_drawn_patterns(plan):
    for number in range(len(plan.patterns)):
        assert _brightness(plan, number) == pytest.approx(plan.draw(number).mean() / 255, abs=0.02)


def test_reverse_is_told(plan, photos):
    (fault,) = find_other_order(photos[::-1], plan)
    count = len(photos)
    assert fault.photos == tuple(range(count))
    assert fault.others == fault.photos[::-1]
    assert f"photos 0 to {count - 1} are in reverse" in str(fault)


@pytest.mark.parametrize(
    ("late", "said"),
    [
        (1, "the photo before"),
        (2, "the second photo before"),
        (3, "the third photo before"),
        (-1, "the photo after"),
        (-2, "the second photo after"),
    ],
)
@pytest.mark.parametrize("first", [5, 18])
def test_photos_that_are_late_from_one_on_are_told(plan, photos, late, said, first):
    wrong, count = photos.copy(), len(photos)
    numbers = np.clip(np.arange(first, count) - late, 0, count - 1)
    wrong[first:] = photos[numbers]
    (fault,) = find_other_order(wrong, plan)
    assert {photo - other for photo, other in zip(fault.photos, fault.others, strict=True)} == {
        late
    }
    # Photos of one brightness between the moment and the next white do not tell.
    assert first <= fault.photos[0] < first + 21
    assert fault.photos[-1] == (count - 1 if late > 0 else count - 1 + late)
    assert f"show the pattern of {said}" in str(fault)
