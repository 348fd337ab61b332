"""Changes of a whole capture, by the normal equations of its photos."""

import numpy as np
import pytest

from nearfar.faults.of_light import ExposureChanged, LampFlickers
from nearfar.faults.of_photos import Moved, NotLinear
from nearfar.workflow.diagnosis.bend_of_pairs import Bend
from nearfar.workflow.diagnosis.misfit import (
    BEND,
    CAUSES,
    DOWN,
    GAIN,
    OFFSET,
    PROJECTOR_DOWN,
    PROJECTOR_FOCUS,
    REGIONS_A_SIDE,
    NormalEquations,
)
from nearfar.workflow.diagnosis.whole_capture import find_changes, find_changes_of_light

PHOTOS = 100
WHITES = np.arange(0, PHOTOS, 11)
VALUES = 1000
# Weighted squares of a unit of an effect in one region of a photo.
INFORMATION = 500.0


def found(
    cause, sizes, *, regions=slice(None), information=INFORMATION, misfit=None, of_pairs=None
):
    """Return the changes found in photos whose only difference is one cause, of these sizes."""
    every = REGIONS_A_SIDE**2
    effects = np.zeros((PHOTOS, every, CAUSES))
    effects[:, regions, cause] = np.reshape(sizes, (PHOTOS, 1))
    matrix = np.broadcast_to(information * np.eye(CAUSES), (PHOTOS, every, CAUSES, CAUSES))
    vector = information * effects
    explained = np.einsum("nrc,nrc->n", effects, vector) / VALUES
    misfits = 1 + explained if misfit is None else np.full(PHOTOS, misfit)
    equations = NormalEquations(matrix, vector, VALUES)
    return find_changes(equations, misfits, WHITES, of_pairs=of_pairs)


def step(photo, size=1.0):
    return np.where(np.arange(PHOTOS) < photo, -size / 2, size / 2)


def _of_light(effects, inverses):
    """Find changes of light among photos that differ by gains and offsets alone."""
    every = np.zeros((PHOTOS, 1, CAUSES))
    for photo, (gain, offset) in effects.items():
        every[photo, 0, [GAIN, OFFSET]] = gain, offset
    # So sure that each of them explains more than enough.
    information = 1e8
    matrix = np.broadcast_to(information * np.eye(CAUSES), (PHOTOS, 1, CAUSES, CAUSES))
    equations = NormalEquations(matrix, information * every, VALUES)
    return find_changes_of_light(equations, inverses)


def test_a_photo_and_its_inverse_that_are_white_together_were_under_the_same_light():
    pair = [(30, 31), (31, 30)]
    wrong_model = {30: (-0.0166, 0.0071), 31: (-0.0149, 0.0070)}
    assert _of_light(wrong_model, pair) is None
    assert _of_light(wrong_model, [])[1].photos == (30, 31)


@pytest.mark.parametrize(
    "effects",
    [
        {30: (-0.02, 0.0)},
        {30: (-0.02, 0.0), 31: (-0.02, 0.0)},
        {30: (-0.02, 0.0), 31: (0.02, 0.0)},
        {30: (0.0, 0.02), 31: (0.0, 0.02)},
        {30: (0.0, 0.02)},
    ],
)
def test_other_light_is_found_in_photos_with_an_inverse(effects):
    _, change = _of_light(effects, [(30, 31), (31, 30)])
    assert change.photos == tuple(effects)


def test_no_exposure_takes_away_more_than_all_light():
    assert _of_light({30: (-0.9, 0.0), 50: (-1.5, 0.0)}, [])[1].photos == (30,)
    assert _of_light({50: (-1.5, 0.0)}, []) is None


@pytest.mark.parametrize("cause", [PROJECTOR_DOWN, PROJECTOR_FOCUS])
@pytest.mark.parametrize("photo", [20, 47, 80])
def test_a_projector_that_changes_once_is_found_with_its_moment(cause, photo):
    assert found(cause, step(photo)) == [Moved("projector", photo, None)]


@pytest.mark.parametrize("cause", [PROJECTOR_DOWN, PROJECTOR_FOCUS])
def test_an_effect_of_all_photos_is_no_change(cause):
    # As where a prior pulls what is hardly measured towards 0: all patterns look out of focus.
    assert found(cause, np.ones(PHOTOS)) == []


@pytest.mark.parametrize("cause", [PROJECTOR_DOWN, PROJECTOR_FOCUS])
def test_an_effect_of_a_few_photos_is_no_change(cause):
    assert found(cause, 5.0 * np.isin(np.arange(PHOTOS), range(60, 65))) == []


def test_a_camera_moves_everywhere_and_a_part_of_the_scene_does_not():
    (camera,) = found(DOWN, step(44, 0.5))
    (scene,) = found(DOWN, step(44, 0.5), regions=slice(3))
    for moved, what in ((camera, "camera"), (scene, "scene")):
        assert moved.what == what
        assert 33 < moved.photo <= 44
        assert moved.pixels == pytest.approx(0.5)


def stay(photo, until, size=1.0):
    return np.where((np.arange(PHOTOS) >= photo) & (np.arange(PHOTOS) < until), size, 0.0)


@pytest.mark.parametrize(("photo", "until"), [(24, 31), (30, 60), (5, 9), (60, 80)])
def test_a_camera_that_moved_and_was_back_is_found_with_both_moments(photo, until):
    sizes = stay(photo, until, 0.4)
    (fault,) = found(DOWN, sizes)
    assert fault == Moved("camera", photo, None, until)
    assert f"shoot photos {photo} to {until - 1} again" in str(fault)


def test_a_camera_that_stays_where_it_moved_is_not_back():
    for photo in (20, 44, 70):
        (fault,) = found(DOWN, step(photo, 0.5))
        assert fault.until is None


def test_a_motion_there_and_back_that_whites_do_not_show_is_none():
    # Whites tell of one motion, other photos of another: what they share is told.
    sizes = stay(23, 32, 0.3)
    sizes[WHITES] = np.where(WHITES < 60, -0.5, 0.5)
    assert found(DOWN, stay(23, 32, 0.3))[0].until == 32
    assert all(fault.until is None for fault in found(DOWN, sizes))


def test_light_below_one_percent_is_no_change():
    few = np.isin(np.arange(PHOTOS), [5, 50])
    (fault,) = found(GAIN, np.where(few, 0.02, 0.0), information=1e7)
    assert fault == ExposureChanged((5, 50), pytest.approx(0.02), 0.0)
    assert found(GAIN, np.where(few, 0.009, 0.0), information=1e7) == []


def test_light_that_changes_all_the_time_flickers():
    (fault,) = found(GAIN, np.random.default_rng(0).standard_normal(PHOTOS))
    assert isinstance(fault, LampFlickers)


def test_a_bend_that_explains_next_to_nothing_of_bad_fits_is_none():
    # Of a scene that the model cannot represent.
    (fault,) = found(BEND, np.full(PHOTOS, 0.2))
    assert fault == NotLinear("")
    assert found(BEND, np.full(PHOTOS, 0.2), misfit=20.0) == []


@pytest.mark.parametrize("size", [0.2, -0.2])
def test_a_bend_that_inverse_photos_surely_contradict_is_none(size):
    bends = np.full(PHOTOS, size)
    for of_pairs in (Bend(size, 0.01), Bend(2 * size, 0.01), Bend(0.0, 0.2)):
        assert found(BEND, bends, of_pairs=of_pairs) == [NotLinear("")]
    for of_pairs in (Bend(0.0, 0.05), Bend(-size, 0.05)):
        assert found(BEND, bends, of_pairs=of_pairs) == []


def test_what_explains_more_than_photos_differ_beyond_noise_is_noise():
    assert found(PROJECTOR_FOCUS, step(47), misfit=1.1) == []


def test_a_few_photos_tell_nothing():
    equations = NormalEquations(np.zeros((8, 9, CAUSES, CAUSES)), np.zeros((8, 9, CAUSES)), VALUES)
    assert find_changes(equations, np.full(8, 50.0), np.array([0, 7])) == []
