"""Jumps of light are told by the photos of white and black between which they were."""

import numpy as np
import pytest

from nearfar.faults.of_light import AmbientJumped, ColoursJumped, ExposureChanged, LampJumped
from nearfar.faults.of_photos import Moved
from nearfar.faults.of_single_photos import PhotosMisfit
from nearfar.photometry.drift import References
from nearfar.workflow.diagnosis.jumps import find_jump_of_colours, name_jumps

REFERENCES = References(np.array([1, 21, 41]), np.array([0, 20, 40]))
WHITE, BLACK = 0.8, 0.1


def photos_with(gains, offsets):
    """Photos of white and black under light of some gain and offset."""
    photos = np.full((42, 4, 4, 3), 0.4, dtype=np.float32)
    for number in REFERENCES.whites:
        photos[number] = BLACK + gains[number] * (WHITE - BLACK) + offsets[number]
    for number in REFERENCES.blacks:
        photos[number] = BLACK + offsets[number]
    return photos


def step(at, size):
    return np.where(np.arange(42) >= at, size, 0.0)


@pytest.mark.parametrize(("at", "between"), [(10, (1, 21)), (30, (21, 41))])
def test_a_lamp_that_dims_at_once_is_found(at, between):
    photos = photos_with(1 + step(at, -0.1), step(at, 0.0))
    seen = ExposureChanged((at - 1, at, at + 1), -0.05, 0.01)
    (found,) = name_jumps([seen], photos, REFERENCES)
    assert isinstance(found, LampJumped)
    assert (found.after, found.before) == between
    # As a share of the mean white.
    assert found.gain == pytest.approx(-0.1, abs=0.01)
    assert f"between photos {between[0]} and {between[1]}" in str(found)


def test_ambient_light_that_comes_on_at_once_is_found():
    photos = photos_with(1 + step(0, 0.0), step(30, 0.07))
    seen = [ExposureChanged((28, 29), 0.01, -0.05), PhotosMisfit((30, 31)), PhotosMisfit((4,))]
    found, other = name_jumps(seen, photos, REFERENCES)
    # Those between the two photos of black do not fit because of it.
    assert other == seen[2]
    assert isinstance(found, AmbientJumped)
    assert (found.after, found.before) == (20, 40)
    assert found.offset == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("photos", "numbers"),
    [
        # Drift is steady.
        (photos_with(1 - 0.1 * np.arange(42) / 42, step(0, 0.0)), (29, 30)),
        # The photos are not between the two.
        (photos_with(1 + step(30, -0.1), step(0, 0.0)), (10, 30)),
        # Less than what is seen in these photos.
        (photos_with(1 + step(30, -0.02), step(0, 0.0)), (29, 30)),
    ],
)
def test_other_photos_stay_as_they_were_found(photos, numbers):
    found = [Moved("camera", 20, 0.5), ExposureChanged(numbers, -0.05, 0.0)]
    assert name_jumps(found, photos, REFERENCES) == found


WHITES = np.array([1, 21, 41, 61, 81])
STEADY = np.ones((5, 3))


def after(place, gains):
    return np.where(np.arange(5)[:, None] >= place, gains, 0.0)


@pytest.mark.parametrize("place", [1, 2, 4])
def test_colours_that_change_at_once_are_found_between_two_photos_of_white(place):
    lamp = STEADY + after(place, [0.04, 0.0, -0.03])
    (found,) = find_jump_of_colours(lamp, WHITES)
    assert isinstance(found, ColoursJumped)
    assert (found.after, found.before) == (WHITES[place - 1], WHITES[place])
    assert found.gains == pytest.approx((0.04, 0.0, -0.03))
    assert "+4.0%, +0.0%, -3.0%" in str(found)


@pytest.mark.parametrize(
    "lamp",
    [
        pytest.param(STEADY + after(2, [0.1, 0.1, 0.1]), id="brightness alone"),
        pytest.param(STEADY + after(2, [0.01, 0.0, -0.01]), id="hardly"),
        pytest.param(1 + np.arange(5)[:, None] * [0.03, 0.0, -0.03], id="steadily"),
        pytest.param(STEADY + after(2, [0.04, 0, 0]) - after(3, [0.04, 0, 0]), id="one white"),
        pytest.param((STEADY + after(2, [0.1, 0, 0]))[:, :1], id="one channel"),
    ],
)
def test_colours_that_do_not_change_at_once_are_no_jump(lamp):
    assert find_jump_of_colours(lamp, WHITES) == []


def test_three_photos_of_white_do_not_tell_a_jump_of_colours_from_drift():
    lamp = STEADY + after(1, [0.04, 0.0, -0.03])
    assert find_jump_of_colours(lamp[:3], WHITES[:3]) == []
