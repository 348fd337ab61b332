"""Which method finds q in the photos of a plan."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.correspondence import (
    correspond_by_gray_code,
    correspond_by_phase,
    correspond_by_stripes,
    find_correspondence,
    method_named,
    method_of,
)
from nearfar.errors import InputError
from nearfar.photometry.measure import measure
from nearfar.plan import CORRESPONDENCE_METHODS, paper_plan
from tests.worlds import model_transport

PROJECTOR = Size(16, 12)
CAMERA = Size(9, 10)


def _plan(correspondence):
    return paper_plan(PROJECTOR, 5, Size(5, 5), correspondence=correspondence)


@pytest.mark.parametrize(
    ("planned", "named", "found"),
    [
        ("stripes", "stripes", "stripes"),
        ("gray", "gray", "gray"),
        ("phase", "phase", "phase"),
        ("none", "none", "phase"),
        # What a plan holds counts where its name does not.
        ("gray", "stripes", "gray"),
        ("stripes", "none", "stripes"),
    ],
)
def test_a_plan_is_served_by_the_method_that_it_names_or_holds(planned, named, found):
    plan = _plan(planned).model_copy(update={"correspondence": named})
    assert method_of(plan) is CORRESPONDENCE_METHODS[found]


@pytest.mark.parametrize("name", ["stripes", "gray"])
def test_a_capture_that_ended_early_is_served_by_phase(name):
    plan = _plan(name)
    ended = plan.first(len(plan.patterns) - 1)
    assert method_of(ended) is CORRESPONDENCE_METHODS["phase"]
    # Phase tells sidelobes by two rows beside, and mirrored surfaces by one more.
    assert method_of(ended).rows_needed(ended) == 3
    assert method_of(plan).rows_needed(plan) == 0


@pytest.mark.parametrize(
    ("name", "by_itself"),
    [("stripes", correspond_by_stripes), ("gray", correspond_by_gray_code), ("phase", None)],
)
def test_each_method_finds_what_it_finds_by_itself(shoot, name, by_itself):
    world = model_transport(PROJECTOR, CAMERA, window=5, far=Size(3, 3)).with_gains(near=0.2)
    photos, rows = shoot(_plan(name), world), slice(2, 7)
    measurements = measure(photos, rows)
    expected = by_itself(photos, rows) if by_itself else correspond_by_phase(measurements)
    found = find_correspondence(photos, measurements, rows)
    assert found.q.shape == (5, 10, 2)
    np.testing.assert_array_equal(found.q, expected.q)
    np.testing.assert_array_equal(found.confidence, expected.confidence)


def test_photos_that_do_not_settle_q_are_refused(shoot):
    plan = paper_plan(PROJECTOR, 3, Size(1, 1), correspondence="none")
    photos = shoot(plan, model_transport(PROJECTOR, CAMERA, window=3, far=Size(1, 1)))
    with pytest.raises(InputError, match="leave places on the pattern grid"):
        find_correspondence(photos, measure(photos))


def test_a_method_that_leaves_q_to_be_given_finds_none():
    assert method_named("gray").serves(_plan("gray"))
    with pytest.raises(InputError, match="'none' finds no correspondence"):
        method_named("none")
