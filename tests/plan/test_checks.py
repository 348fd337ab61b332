"""Check patterns: how many, of which sort, with their inverses, and where they stand."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import InputError, PlanError
from nearfar.illumination.frequencies import DC
from nearfar.plan import choose_plan, paper_plan
from nearfar.plan.checks import (
    check_lights,
    check_pairs,
    check_patterns,
    is_reference,
    spread_checks,
)
from nearfar.plan.patterns import HalfScreen, Picture, Sinusoid


@pytest.mark.parametrize(("photos", "pairs"), [(24, 1), (56, 1), (117, 2), (200, 4), (468, 9)])
def test_about_four_percent_of_the_photos_are_checks_and_at_least_two(photos, pairs):
    assert check_pairs(photos) == pairs


@pytest.mark.parametrize("projector", [Size(16, 20), Size(31, 24)])
def test_a_chosen_plan_has_them_within_its_number_of_photos(projector):
    plan, _ = choose_plan(projector, 117)
    assert 116 <= len(plan.patterns) <= 117
    assert plan.counts["check"] == 4
    lights = check_lights(plan)
    assert [light.pattern for light in lights] == [
        Picture(seed=101),
        HalfScreen(kind="left half-screen"),
    ]
    for light in lights:
        # Next to each other, so that little time passes between them.
        assert light.inverses[0] == light.photos[0] + 1
        both = plan.draw(light.photos[0]).astype(int) + plan.draw(light.inverses[0])
        assert np.all(both == 255)


def test_without_them_all_photos_are_for_the_estimate():
    plan, _ = choose_plan(Size(16, 20), 60, checks=0)
    assert plan.counts["check"] == 0
    assert check_lights(plan) == []


@pytest.mark.parametrize(("photos", "projector"), [(38, Size(16, 20)), (150, Size(31, 24))])
def test_they_cost_references_and_no_frequency(photos, projector):
    plan, _ = choose_plan(projector, photos)
    without, _ = choose_plan(projector, photos, checks=0)
    assert plan.counts["check"] == 2 * check_pairs(photos)
    waves, others = (
        [p for p in one.patterns if isinstance(p, Sinusoid) and p.frequency != DC]
        for one in (plan, without)
    )
    assert waves == others
    # White and black are still there at the start and at the end.
    assert {is_reference(plan.patterns[at]) for at in (0, 1, -2, -1)} == {True}


def test_many_of_them_leave_half_of_the_references():
    plan, without = (choose_plan(Size(24, 24), 150, checks=n)[0] for n in (20, 0))
    references, all_of_them = (sum(map(is_reference, one.patterns)) for one in (plan, without))
    assert references == all_of_them / 2


def test_a_plan_has_as_many_as_asked_for():
    plan, _ = choose_plan(Size(16, 20), 60, checks=3)
    assert plan.counts["check"] == 6


@pytest.mark.parametrize("checks", [-1, 1.5, "2", True])
def test_a_number_of_checks_that_is_none_is_refused(checks):
    with pytest.raises(InputError, match="checks"):
        choose_plan(Size(16, 20), 60, checks=checks)


def test_too_many_leave_nothing_to_estimate_from():
    with pytest.raises(PlanError, match="`photos=44`"):
        choose_plan(Size(16, 20), 40, checks=10)


@pytest.mark.parametrize("pairs", [1, 2, 5, 9])
def test_they_are_spread_and_part_no_cosine_from_its_sine(pairs):
    patterns = [
        p for p in paper_plan(Size(16, 20), 5, Size(3, 3), correspondence="none").patterns
        if not p.inverse
    ]  # fmt: skip
    checks = check_patterns(pairs, Size(16, 20))
    found = spread_checks(patterns, checks)
    assert [p for p in found if p.purpose != "check"] == patterns
    assert [p for p in found if p.purpose == "check"] == checks
    places = [i for i, p in enumerate(found) if p.purpose == "check"][::2]
    if pairs > 1:
        assert np.diff(places).max() <= 2 * len(found) / pairs
    for place in places:
        before, after = found[place - 1], found[place + 2]
        parted = (before.kind, after.kind) == ("cosine", "sine")
        assert not (parted and before.frequency == after.frequency)
