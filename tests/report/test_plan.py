"""What is said of a plan that was chosen by a look at the scene."""

import pytest

from nearfar.arrays import Size
from nearfar.plan import paper_plan
from nearfar.plan.look import Look
from nearfar.priors.fitted import TYPICAL_SCENES
from nearfar.report.plan import describe_look

PROJECTOR = Size(24, 24)


def said(window, *, reach=1.5, wanted=5, photos=None):
    """Return what is said of a plan of a window, after a look with W = 5."""
    look = Look(TYPICAL_SCENES, 0.01, 5, reach, wanted, free_share=0.0)
    plan = paper_plan(PROJECTOR, window, Size(3, 3), offset="reference", correspondence="none")
    return describe_look(look, plan, photos), len(plan.patterns)


def test_a_look_without_near_range_light_says_so():
    assert said(5, reach=None)[0].startswith("the look shows hardly any near-range light: ")


@pytest.mark.parametrize(("reach", "more"), [(1.5, ""), (5.0, " or more")])
def test_the_window_of_the_look_needs_no_more_photos(reach, more):
    assert said(5, reach=reach)[0] == (
        f"near-range light falls by a factor e in {reach}{more} projector pixels in the look: "
        f"planned with W = 5"
    )


@pytest.mark.parametrize(
    ("window", "wanted", "further", "asked"),
    [(9, 9, True, False), (7, 9, True, True), (7, 5, False, True)],
)
def test_a_larger_window_says_why_and_what_it_takes(window, wanted, further, asked):
    text, count = said(window, wanted=wanted, photos=80)
    assert text == (
        "near-range light falls by a factor e in 1.5 projector pixels"
        + (", and reaches further than the look's W = 5" if further else "")
        + f": planned with W = {window}"
        + (", as asked" if asked else "")
        + f", for which about 80 photos leave as little unknown as {count} for W = 5"
    )
