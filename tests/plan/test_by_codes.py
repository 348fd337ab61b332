"""Plans of all codes, where the photos suffice."""

import re
from collections import Counter
from dataclasses import replace

import pytest

from nearfar.arrays import Size
from nearfar.errors import PlanError
from nearfar.illumination.frequencies import DC
from nearfar.plan import choose_plan, parse_plan
from nearfar.plan.checks import ends, with_checks
from nearfar.plan.choose_frequencies import choose_frequencies
from nearfar.plan.codes import code, count_of_codes, order_of_codes
from nearfar.plan.patterns import LampCode, Sinusoid
from nearfar.plan.sharing import plan_of_each, shared_plan
from nearfar.report.methods import reconstruction_methods
from nearfar.report.plan import describe_plan
from nearfar.report.reconstruction import plan_table
from tests.worlds import model_transport

PROJECTOR = Size(8, 8)
CODES = 67


def codes_of(plan):
    return [p for p in plan.patterns if isinstance(p, LampCode)]


def waves_of(plan):
    return [p for p in plan.patterns if isinstance(p, Sinusoid) and p.frequency != DC]


@pytest.mark.parametrize(
    ("fewest", "options"),
    [
        # Whites and blacks, of which check photos take the place, and photos to check by.
        (CODES + 4 + 2, {}),
        (CODES + 6, {"checks": 0}),
        (CODES + 4 + 2, {"every_frequency": True}),
        (CODES + 4, {"every_frequency": True, "checks": 0}),
    ],
)
def test_codes_are_planned_from_the_fewest_photos_on(fewest, options):
    assert not choose_plan(PROJECTOR, fewest - 1, **options)[0].is_by_codes
    plan, _ = choose_plan(PROJECTOR, fewest, **options)
    assert plan.is_by_codes
    assert not plan.is_of_lamps
    assert len(plan.patterns) == fewest


@pytest.mark.parametrize("photos", [80, 99, 138, 140, 141, 150, 211, 400])
def test_every_code_is_shown_as_often_as_the_others(photos):
    plan, _ = choose_plan(PROJECTOR, photos)
    times = Counter(p.row for p in codes_of(plan))
    assert set(times) == set(range(CODES))
    assert len(set(times.values())) == 1
    assert len(plan.patterns) == photos
    assert plan.counts["check"] >= 2
    assert plan.correspondence == "phase"
    assert parse_plan(plan.to_json()) == plan


def test_the_rest_is_of_the_lowest_waves_with_their_inverses():
    plan, _ = choose_plan(Size(16, 16), 500)
    waves = Counter(waves_of(plan))
    assert len(waves) > 60
    for wave, times in waves.items():
        assert waves[wave.model_copy(update={"inverse": not wave.inverse})] == times
    assert max(abs(16 * part) for wave in waves for part in wave.frequency) < 8
    # They stand among the codes from the start to the end.
    places = [i for i, p in enumerate(plan.patterns) if p in waves]
    assert places[0] < 25
    assert places[-1] > 475


def test_codes_are_expected_to_do_better_than_sinusoids():
    for side, photos in ((16, 320), (16, 512), (24, 700)):
        of_codes = choose_plan(Size(side, side), photos, checks=0)[1]
        of_sinusoids = choose_frequencies(Size(side, side), photos, 5).expected
        assert of_codes.pictures > of_sinusoids.pictures + 0.9
        assert of_codes.random > of_sinusoids.random + 0.9


def test_lines_of_pixels_have_windows_of_single_pixels():
    sinusoids, _ = choose_plan(Size(1, 512), 200)
    assert sinusoids.pitch > 1
    codes, _ = choose_plan(Size(1, 512), 620)
    assert codes.is_by_codes
    assert (codes.pitch, codes.window) == (1, 25)


def test_projectors_of_more_pixels_than_are_taken_apart_have_sinusoids():
    assert count_of_codes(Size(65, 65)) == float("inf")
    assert count_of_codes(Size(64, 64)) == 4099


def test_no_code_comes_again_before_all_of_its_order():
    for least in (3, 60, 256):
        order = order_of_codes(least)
        assert order >= least
        assert {code(number, order).row for number in range(order)} == set(range(order))


def test_nothing_can_be_checked_on_the_way():
    plan, _ = choose_plan(PROJECTOR, 80)
    assert ends(plan) == [80]
    with pytest.raises(PlanError, match=r"only after its last photo.*no more than the 64"):
        with_checks(plan)


def test_projectors_share_photos_of_codes():
    plan, _ = choose_plan(PROJECTOR, 80)
    assert plan_of_each(shared_plan(plan, 2)).patterns == plan.patterns


def test_a_plan_of_codes_is_described():
    said = describe_plan(choose_plan(PROJECTOR, 80)[0])
    assert "projector 8x8, W = 5" in said
    assert "codes of half of the projector's pixels" in said
    assert "80 photos: 67 codes, 4 to check by, 9 white and black" in said


def test_methods_count_codes_and_sinusoids():
    photos = model_transport(PROJECTOR, Size(3, 4), window=5, far=Size(3, 3))
    transport = replace(photos, provenance={"method": "joint", "square": False})
    said = reconstruction_methods(transport, choose_plan(PROJECTOR, 99)[0], "Checked.").text
    assert "from 99 photos: 67 codes, 16 sinusoids with their inverses, 4 to check by" in said
    assert "12 white and black. Each code lit about half" in said


def test_a_report_counts_codes_and_no_checkerboard():
    table = plan_table(choose_plan(PROJECTOR, 99)[0])
    for sort, count in (("codes", 67), ("sinusoids with their inverses", 16)):
        assert re.search(rf"{sort}</\w+>\s*<\w+[^>]*>{count}<", table), table
    assert "checkerboard" not in table
