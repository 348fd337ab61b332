"""A projector that moves far is told with the moment and the distance, not as single photos."""

import numpy as np
import pytest
from benchmarks.spoils import SPOILS, shoot
from scipy import ndimage

from nearfar.arrays import Size
from nearfar.faults.of_photos import Moved, SceneChanged
from tests.workflow.diagnosis.test_diagnosis import found_in

SIZE, PHOTOS = Size(20, 24), 90


@pytest.fixture(scope="module")
def shot():
    return shoot("cornell", SIZE, PHOTOS)


def photos_after(shot, moment, shift):
    """Return photos of a projector that moves by a shift (down, across) before a photo."""

    def shown(pattern, number):
        by = np.array(shift) if number >= moment else (0.0, 0.0)
        return ndimage.shift(pattern.astype(float), by, order=1, mode="nearest")

    return shot.again(shown)


@pytest.mark.parametrize(
    ("share", "shift"),
    [
        (0.5, (0.0, 1.0)),
        (0.5, (3.0, 0.0)),
        (0.3, (0.0, -2.0)),
        (0.7, (1.0, 0.5)),
    ],
)
def test_moment_and_distance_of_a_projector_that_moved_are_told(tmp_path, shot, share, shift):
    moment = round(share * len(shot.photos))
    found = found_in(photos_after(shot, moment, shift), shot, tmp_path)
    assert [type(each) for each in found] == [Moved], "; ".join(map(str, found))
    assert found[0].what == "projector"
    # Photos of white and black, and of patterns that are even along the shift, do not tell it.
    assert moment <= found[0].photo <= moment + 5
    assert found[0].pixels == pytest.approx(np.hypot(*shift), abs=0.15)
    far = "1 projector pixel before" if np.hypot(*shift) == 1 else "projector pixels before"
    assert far in str(found[0])


@pytest.mark.parametrize(
    ("name", "strength"),
    [
        ("photos swapped", 4),
        ("one photo late for a while", 4),
        ("photos torn", 1),
        ("camera moved, pixels", 1),
        ("projector out of focus, pixels", 0.6),
    ],
)
def test_what_else_spoils_photos_is_no_projector_that_moved_far(tmp_path, shot, name, strength):
    found = found_in(SPOILS[name].apply(shot, strength), shot, tmp_path)
    assert found[0].cause in SPOILS[name].causes, "; ".join(map(str, found))
    assert not any(
        isinstance(each, Moved) and each.what == "projector" and each.pixels for each in found
    )


def test_a_part_that_moved_far_is_told_by_white(tmp_path):
    """Here a photo looks torn, as some of its rows fit another pattern."""
    shot = shoot("cornell", Size(32, 32), PHOTOS)
    found = found_in(SPOILS["part of the scene moved, pixels"].apply(shot, 1.0), shot, tmp_path)
    assert [type(each) for each in found] == [SceneChanged], "; ".join(map(str, found))
