"""Whites and blacks through a plan: evenly, side by side, and counted for what they are."""

import json
from itertools import pairwise

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import PlanError
from nearfar.illumination.frequencies import DC
from nearfar.plan import Sinusoid, paper_plan, parse_plan, with_references
from nearfar.plan.references import INTERVAL, reference_count

PATTERNS = paper_plan(Size(16, 20), 5, Size(3, 3)).patterns


def _places(patterns):
    """Numbers of the whites and of the blacks."""
    uniform = [
        (i, p.inverse)
        for i, p in enumerate(patterns)
        if isinstance(p, Sinusoid) and p.frequency == DC
    ]
    return [i for i, black in uniform if not black], [i for i, black in uniform if black]


OTHERS = tuple(p for p in PATTERNS if not isinstance(p, Sinusoid) or p.frequency != DC)


@pytest.mark.parametrize(("whites", "blacks"), [(None, None), (2, 2), (8, 8), (9, 4), (3, 11)])
def test_references_stand_evenly_and_the_rest_in_its_order(whites, blacks):
    made = with_references(OTHERS, whites, blacks)
    at_white, at_black = _places(made)
    assert len(at_white) == (whites or reference_count(len(OTHERS)))
    assert len(at_black) == (blacks or reference_count(len(OTHERS)))
    assert tuple(p for i, p in enumerate(made) if i not in {*at_white, *at_black}) == OTHERS
    for places in (at_white, at_black):
        assert places[0] <= 1
        assert places[-1] >= len(made) - 2
        steps = np.diff(places)
        # Within what a whole number of the others' places rounds to.
        assert steps.max() <= 1.5 * steps.mean() + 3
    fewer, more = sorted((at_white, at_black), key=len)
    assert all(min(abs(i - j) for j in more) == 1 for i in fewer)


def test_the_first_white_is_the_dc_frequency():
    made = with_references(OTHERS, 4, 4)
    at_white, at_black = _places(made)
    assert [made[i].purpose for i in at_white] == ["far", "reference", "reference", "reference"]
    assert {made[i].purpose for i in at_black} == {"reference"}


@pytest.mark.parametrize("photos", [1, 30, 300, 3000])
def test_a_plan_has_references_every_interval(photos):
    count = reference_count(photos)
    assert count >= 2
    if photos >= 300:
        assert photos / (count - 1) == pytest.approx(INTERVAL, rel=0.05)


@pytest.mark.parametrize("counts", [(1, 5), (5, 1), (0, 0)])
def test_one_of_a_kind_tells_nothing(counts):
    with pytest.raises(PlanError, match="estimate noise and drift from: plan for at least 2"):
        with_references(OTHERS, *counts)


def test_few_patterns_may_have_more_references():
    made = with_references(OTHERS[:2], 5, 5)
    assert len(made) == 12
    assert [p for p in made if p.purpose not in {"far", "reference"}] == list(OTHERS[:2])


@pytest.mark.parametrize(
    ("projector", "window", "far", "photos"),
    [(Size(128, 128), 19, Size(13, 13), 530), (Size(128, 128), 15, Size(13, 13), 394)],
)
@pytest.mark.parametrize("correspondence", ["stripes", "phase", "none"])
def test_half_the_papers_photos(projector, window, far, photos, correspondence):
    plan = paper_plan(projector, window, far, offset="reference", correspondence=correspondence)
    assert plan.transport_photos == photos
    assert plan.savings == projector.pixels / photos
    found = plan.summary()
    assert found["photos"]["correspondence"] == (256 if correspondence == "stripes" else 0)
    assert found["total_photos"] == len(plan.patterns) == sum(found["photos"].values())
    # References run through the stripes as well, from the first photo to the last.
    whites, blacks = _places(plan.patterns)
    assert len(whites) + len(blacks) == found["photos"]["reference"] + 1
    assert max(b - a for a, b in pairwise(whites)) <= INTERVAL + 4
    assert parse_plan(plan.to_json()) == plan


def test_a_plan_of_version_1_still_reads():
    plan = paper_plan(Size(8, 8), 3, Size(3, 3))
    old = json.loads(plan.to_json()) | {"version": 1}
    assert parse_plan(json.dumps(old)) == plan


def test_repeated_patterns_come_back_from_their_file():
    plan = paper_plan(Size(8, 8), 3, Size(3, 3), offset="reference", correspondence="phase")
    twice = plan.model_copy(update={"patterns": plan.patterns + plan.patterns[2:5]})
    assert parse_plan(twice.to_json()) == twice
    assert twice.summary()["total_photos"] == len(plan.patterns) + 3
