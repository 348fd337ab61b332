"""How far apart the functions of a window stand, and how many there are."""

import base64
import json
import re

import imagecodecs
import pytest

from nearfar.arrays import Size
from nearfar.plan import default_window, largest_window, paper_plan, parse_plan, pitch_of
from nearfar.plan.model import READABLE_VERSIONS


@pytest.mark.parametrize(
    ("projector", "pitch"),
    [
        (Size(64, 64), 1),
        (Size(106, 110), 1),
        (Size(107, 107), 4),
        (Size(128, 128), 4),
        (Size(100, 1920), 1),
        (Size(1, 128), 1),
        (Size(129, 200), 4),
        (Size(256, 256), 8),
        (Size(512, 512), 16),
        (Size(720, 1280), 16),
        (Size(1, 640), 16),
        (Size(1080, 1920), 32),
        (Size(2160, 3840), 64),
    ],
)
def test_the_pitch_leaves_some_forty_cells_on_the_shorter_side(projector, pitch):
    assert pitch_of(projector) == pitch
    if pitch > 1:
        shorter = min(side for side in projector if side > 1)
        assert 26.5 < shorter / pitch <= 53


@pytest.mark.parametrize("side", [8, 64, 68, 106, 107, 128, 161, 256, 1080, 2160])
def test_the_default_window_is_odd_and_fits(side):
    projector = Size(side, 2 * side)
    pitch = pitch_of(projector)
    window = default_window(projector, pitch)
    assert window % 2 == 1
    assert 1 <= pitch * (window - 1) + 1 <= side
    assert window <= (25 if pitch == 1 else 9)
    largest = largest_window(projector, pitch)
    assert pitch * (largest - 1) + 1 <= side < pitch * largest + 1


def test_plans_without_a_pitch_are_of_single_pixels():
    plan = paper_plan(Size(8, 9), 3, Size(3, 3))
    data = json.loads(plan.to_json())
    assert (data["version"], data.pop("pitch")) == (7, 1)
    for version in READABLE_VERSIONS:
        assert parse_plan(json.dumps(data | {"version": version})) == plan


def test_a_pitch_comes_back_from_its_file():
    plan = paper_plan(Size(64, 72), 3, Size(3, 3)).model_copy(update={"pitch": 16})
    assert parse_plan(plan.to_json()) == plan


def test_the_card_of_a_notebook_holds_small_pictures():
    plan = paper_plan(Size(300, 700), 3, Size(3, 3), correspondence="none")
    card = plan._repr_html_()
    found = [base64.b64decode(part) for part in re.findall(r"base64,([^\"]*)", card)]
    assert len(found) == 5
    for png in found:
        assert imagecodecs.imread(png).shape == (100, 233)
