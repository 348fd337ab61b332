"""Motion by whole pixels is told by the photos of white, with its moment."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import ndimage

from nearfar.arrays import Size
from nearfar.photometry.drift import References
from nearfar.workflow.diagnosis.shifted_whites import MOST_SIDE, find_shifted_whites, shift_between

PHOTOS = 40
WHITES = np.array([1, 13, 26, 38])
BLACK, NOISE = 0.02, 0.003


def textured(camera, seed=0):
    """Return albedo with edges."""
    coarse = np.random.default_rng(seed).random((camera.height // 5 + 1, camera.width // 5 + 1))
    return 0.2 + 0.6 * coarse.repeat(5, axis=0).repeat(5, axis=1)[: camera.height, : camera.width]


def filmed(shifts, camera=Size(60, 75), gains=None, channels=1):
    """Return a capture of fringes and whites of a camera that is shifted in each photo."""
    generator = np.random.default_rng(1)
    albedo = textured(camera)
    x = np.arange(camera.width)
    photos = np.empty((PHOTOS, *camera, channels), dtype=np.float32)
    for number, shift in enumerate(shifts):
        light = 0.5 + 0.4 * np.cos(2 * np.pi * x * (number % 7 + 1) / camera.width + number)
        seen = albedo * (1.0 if number in WHITES else light)
        moved = ndimage.shift(seen, shift, order=3, mode="nearest")
        photos[number] = (BLACK + moved * (1.0 if gains is None else gains[number]))[..., None]
    photos[0] = BLACK
    photos += NOISE * generator.standard_normal(photos.shape).astype(np.float32)
    return SimpleNamespace(camera=camera, read=lambda numbers, rows: photos[numbers][:, rows])


def found(shifts, **options):
    return find_shifted_whites(filmed(shifts, **options), References(WHITES, np.array([0])))


def at(first, last, shift):
    return [shift if first <= number < last else (0, 0) for number in range(PHOTOS)]


@pytest.mark.parametrize("shift", [(1, 0), (0, -2.4), (5, 3), (-0.8, 0.6)])
@pytest.mark.parametrize("photo", [13, 19, 31])
def test_the_photo_and_the_pixels_of_a_motion_are_told(shift, photo):
    (moved,) = found(at(photo, PHOTOS, shift))
    assert (moved.what, moved.photo, moved.until) == ("camera", photo, None)
    assert moved.pixels == pytest.approx(np.hypot(*shift), rel=0.1)


@pytest.mark.parametrize("shift", [(0, 1.5), (0.4, 0.0)])
def test_a_camera_that_was_back_is_told_with_both_moments(shift):
    (moved,) = found(at(17, 30, shift), channels=3)
    assert (moved.photo, moved.until) == (17, 30)
    assert "shoot photos 17 to 29 again" in str(moved)


def test_the_middle_of_a_large_camera_tells():
    camera = Size(MOST_SIDE + 20, 90)
    (moved,) = found(at(20, PHOTOS, (3, 0)), camera=camera)
    assert moved.photo == 20


@pytest.mark.parametrize("shift", [(0, 0), (0.4, 0), (0.3, -0.3)])
def test_less_than_a_pixel_that_stays_is_left_to_regressions(shift):
    assert found(at(20, PHOTOS, shift)) == []


def test_another_lamp_is_no_motion():
    assert found(at(0, 0, (0, 0)), gains=np.linspace(0.7, 1.2, PHOTOS)) == []


def test_a_part_that_moved_is_no_motion_of_the_camera():
    camera = Size(60, 75)
    one = textured(camera)
    other = one.copy()
    other[:25] = np.roll(one[:25], 3, axis=1)
    assert shift_between(one, other) is None
    assert shift_between(one, np.roll(one, 3, axis=1)).across == pytest.approx(3, abs=0.1)
    # Something else altogether, and nothing at all.
    assert shift_between(one, textured(camera, seed=5)) is None
    assert shift_between(np.zeros(camera), np.zeros(camera)) is None


def test_an_even_wall_is_left_at_once(monkeypatch):
    """What whites of an even wall have alike is chance: nothing is shifted for it."""
    camera = Size(300, 280)

    def read(numbers, _rows):
        (number,) = numbers
        is_white = number in WHITES
        generator = np.random.default_rng(number)
        # Shot noise: that of black is the least.
        noise = NOISE * (4 if is_white else 1) * generator.standard_normal((1, *camera, 1))
        return (0.8 if is_white else BLACK) + noise

    wall = SimpleNamespace(camera=camera, read=read)
    tried = []
    monkeypatch.setattr(ndimage, "shift", lambda *given, **_: tried.append(given))
    assert find_shifted_whites(wall, References(WHITES, np.array([0, PHOTOS - 1]))) == []
    assert tried == []
