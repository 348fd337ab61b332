"""What spoils photos is told by name, and good photos are not accused."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from benchmarks.spoils import SPOILS, shoot
from scipy import ndimage

from nearfar.arrays import Size
from nearfar.capture.writing import write_capture
from nearfar.faults.of_light import (
    AmbientFlickers,
    FollowsPattern,
    LampJumped,
    NoisyRows,
    RowsFlicker,
)
from nearfar.faults.of_photos import NotLinear, PixelsFlash, SceneChanged
from nearfar.faults.of_single_photos import (
    PhotosDark,
    PhotosMisfit,
    PhotosMixed,
    PhotosTurned,
    ShowsOtherPattern,
)
from nearfar.photometry.drift_removal import PhotosWithoutDrift
from nearfar.plan import Sinusoid
from nearfar.plan.checks import is_reference
from nearfar.progress import ignore_progress
from nearfar.transport.stored import open_transport
from nearfar.workflow.diagnosis import single_photos
from nearfar.workflow.diagnosis.diagnose import find_what_spoils
from nearfar.workflow.diagnosis.explanations import TURNS, Explanation
from nearfar.workflow.diagnosis.sample import PATCH, sample_camera, sampled_lines
from nearfar.workflow.diagnosis.single_photos import TURNS_OF_LEAVING
from nearfar.workflow.reconstruction.reconstruct import reconstruct_to_file


@pytest.fixture(scope="module")
def shot():
    return shoot("cornell", Size(16, 16), 60)


def found_in(photos, shot, folder, **options):
    """What spoils photos of a shot's plan; the capture and its transport are kept in a folder."""
    capture = write_capture(shot.plan, folder / "c.zarr", list(photos), full_scale=shot.full_scale)
    reconstruct_to_file(capture, folder / "t.zarr")
    return find_what_spoils(open_transport(folder / "t.zarr"), capture, **options)


@pytest.fixture(scope="module")
def diagnosed(shot, tmp_path_factory):
    def diagnose(photos, **options):
        return found_in(photos, shot, tmp_path_factory.mktemp("spoilt"), **options)

    return diagnose


@pytest.fixture(scope="module")
def spoilt_by(shot, diagnosed):
    @cache
    def diagnose(name=None, strength=0.0):
        return diagnosed(shot.photos if name is None else SPOILS[name].apply(shot, strength))

    return diagnose


def test_good_photos_are_not_accused(spoilt_by):
    assert spoilt_by() == []


@pytest.mark.parametrize(
    ("name", "strength"),
    [
        ("gamma", 1.1),
        ("black clipped", 0.05),
        ("camera moved, pixels", 0.3),
        ("projector moved, pixels", 0.2),
        ("photos rotated", 1),
        ("photos doubled", 1),
        ("exposure of three photos", 0.2),
        ("colours swapped", 1),
        ("camera moved for a while, pixels", 0.4),
        ("camera moved for a while, pixels", 2.0),
        ("camera moved far, pixels", 2.0),
        ("saturated below full scale", 0.6),
        ("photos cut off", 1),
        ("all photos in reverse", 1),
        ("photos late from the middle on", 1),
        ("one black under room light", 0.05),
        ("one white brighter", 0.1),
        ("a hand before one white", 1.0),
        ("pixels that flash", 0.01),
    ],
)
def test_what_spoils_photos_is_named(spoilt_by, name, strength):
    found = spoilt_by(name, strength)
    assert found[0].cause in SPOILS[name].causes, "; ".join(map(str, found))


@pytest.mark.parametrize(
    ("name", "strength", "kind"),
    [
        ("black level of each photo", 0.005, AmbientFlickers),
        ("black level of each photo", 0.02, AmbientFlickers),
        ("bands of mains light", 0.02, RowsFlicker),
        ("offsets of the camera's rows", 0.004, NoisyRows),
        ("lamp dimmer from the middle on", 0.05, LampJumped),
        ("dust from the middle on", 0.1, SceneChanged),
    ],
)
def test_what_looks_like_a_response_that_is_not_linear_is_named(spoilt_by, name, strength, kind):
    (found,) = spoilt_by(name, strength)
    assert isinstance(found, kind)


@pytest.mark.parametrize("name", ["lamp dimmer from the middle on", "dust from the middle on"])
def test_what_changed_at_once_did_so_between_two_whites(shot, spoilt_by, name):
    (found,) = spoilt_by(name, 0.1)
    assert found.after < shot.half <= found.before


@pytest.mark.parametrize(
    ("name", "strength", "expected"),
    [
        ("exposure by the mean of a photo", 0.04, FollowsPattern),
        ("gamma", 1.04, NotLinear),
        ("sRGB encoding, in part", 0.1, NotLinear),
    ],
)
def test_automatic_exposure_is_told_from_a_bend_by_half_screens(tmp_path, name, strength, expected):
    shot = shoot("cornell", Size(24, 24), 80)
    (found,) = found_in(SPOILS[name].apply(shot, strength), shot, tmp_path)
    assert isinstance(found, expected)


@pytest.mark.parametrize("share", [0.1, 0.3])
def test_photos_exposed_under_two_patterns_are_told_by_how_much(shot, spoilt_by, share):
    (found,) = spoilt_by("patterns mixed in two photos", share)
    assert isinstance(found, PhotosMixed)
    assert list(found.photos) == shot.chosen(2)
    assert [photo - other for photo, other in zip(found.photos, found.others, strict=True)] == [
        1,
        1,
    ]
    assert found.share == pytest.approx(share, abs=0.02)


def test_a_lens_that_creeps_is_no_ambient_light_that_flickers(tmp_path):
    # It leaves black as it is.
    shot = shoot("cornell", Size(32, 32), 90)
    photos = shot.photos.astype(float)
    for number, photo in enumerate(photos):
        deviation = 0.5 * number / len(photos)
        photos[number] = ndimage.gaussian_filter(photo, (deviation, deviation, 0), mode="nearest")
    found = found_in(shot.counts(photos), shot, tmp_path)
    assert found
    assert {each.cause for each in found} <= {"moved", "focus"}


def test_photos_of_a_dark_projector_are_no_other_order(shot, spoilt_by):
    assert spoilt_by("photos of black", 2) == [PhotosDark(tuple(shot.chosen(2)))]


def test_photos_with_a_window_over_a_part_are_named(tmp_path):
    # It covers little of the picture: the errors of all camera pixels hardly grow.
    shot = shoot("cornell", Size(32, 32), 90)
    photos = SPOILS["a window over six photos"].apply(shot, 1)
    (found,) = found_in(photos, shot, tmp_path)
    assert isinstance(found, PhotosMisfit)
    assert set(found.photos) <= set(range(shot.half + 3, shot.half + 9))
    assert len(found.photos) >= 4


def test_highlights_that_are_compressed_bend_the_sums_of_all_check_photos(tmp_path):
    # The estimate bends with them, and misfits look like exposure; pairs tell.
    shot = shoot("cornell", Size(32, 32), 90)
    photos = SPOILS["highlights compressed"].apply(shot, 0.6)
    assert found_in(photos, shot, tmp_path) == [NotLinear("")]


def test_what_all_camera_pixels_see_alike_is_not_taken_for_light(tmp_path):
    # A tenth of a projector pixel is little, and at this size the transport itself fits much of it.
    shot = shoot("cornell", Size(64, 64), 117)
    photos = SPOILS["projector moved, pixels"].apply(shot, 0.1)
    (found,) = found_in(photos, shot, tmp_path)
    assert found.cause in SPOILS["projector moved, pixels"].causes


def test_noise_of_a_bent_response_does_not_flash(tmp_path):
    shot = shoot("shelf", Size(24, 24), 50)
    found = found_in(SPOILS["gamma"].apply(shot, 2.2), shot, tmp_path)
    assert found
    assert not any(isinstance(each, PixelsFlash) for each in found)


@pytest.mark.parametrize("name", ["photos rotated", "photos doubled", "photos cut off"])
def test_the_photo_is_named(shot, spoilt_by, name):
    (found,) = spoilt_by(name, 1)
    assert list(found.photos) == shot.chosen(1)


@pytest.mark.parametrize(("how", "turn"), TURNS, ids=[how for how, _ in TURNS])
def test_how_a_photo_was_turned_is_told(shot, diagnosed, how, turn):
    (found,) = diagnosed(shot.each(lambda photo, _: turn(photo), 1))
    assert isinstance(found, PhotosTurned)
    assert (found.photos, found.how) == (tuple(shot.chosen(1)), how)


@pytest.mark.parametrize(
    ("name", "strength", "level"),
    [
        ("one black under room light", 0.05, 0.0),
        ("one white brighter", 0.1, 1.0),
        ("a hand before one white", 1.0, 1.0),
    ],
)
def test_a_white_or_black_that_is_odd_is_named_and_no_other(shot, spoilt_by, name, strength, level):
    (found,) = spoilt_by(name, strength)
    assert found.photos == (shot.middle_of(level),)


@pytest.mark.parametrize("pixels", [0.4, 2.0])
def test_photos_of_a_camera_that_was_elsewhere_are_named(shot, spoilt_by, pixels):
    found, *_ = spoilt_by("camera moved for a while, pixels", pixels)
    assert found.photo == pytest.approx(shot.half // 2, abs=3)
    assert found.until == pytest.approx(shot.half, abs=3)


def test_photos_that_are_swapped_explain_each_other(shot, spoilt_by):
    (found,) = spoilt_by("photos swapped", 2)
    assert isinstance(found, ShowsOtherPattern)
    assert list(found.photos) == shot.chosen(2)
    assert found.others == found.photos[::-1]
    assert "are swapped" in str(found)


def test_each_photo_but_white_and_black_is_left_out_in_one_turn(shot, diagnosed, monkeypatch):
    only, relight = PhotosWithoutDrift.only, single_photos.relight
    kept, relit = [], []

    def recorded(self, numbers):
        kept.append(set(numbers.tolist()))
        return only(self, numbers)

    def recorded_pictures(plan, transport, numbers):
        relit.append(set(numbers))
        return relight(plan, transport, numbers)

    monkeypatch.setattr(PhotosWithoutDrift, "only", recorded)
    monkeypatch.setattr(single_photos, "relight", recorded_pictures)
    assert diagnosed(shot.photos, suspected=True) == []
    own = {n for n, p in enumerate(shot.plan.patterns) if isinstance(p, Sinusoid)}
    references = {n for n in own if is_reference(shot.plan.patterns[n])}
    # First each frequency is foretold from all others, for which all photos are measured.
    assert own <= kept[0]
    left_out = [own - each for each in kept[1:]]
    assert sorted(n for each in left_out for n in each) == sorted(own - references)
    assert len(left_out) == TURNS_OF_LEAVING
    assert all(left_out)
    # Check photos are in no estimate anyway: leaving others out would only relight them worse.
    assert relit == left_out


# None of these has a large misfit: the estimate bends to it, as it alone tells of its frequency.
@pytest.mark.parametrize(
    ("name", "strength", "count"),
    [
        ("photos at a quarter", 1, 1),
        ("photos at a quarter", 3, 3),
        ("patterns mixed in two photos", 0.3, 2),
    ],
)
def test_photos_that_the_estimate_bends_to_are_named(shot, spoilt_by, name, strength, count):
    found = spoilt_by(name, strength)
    assert {each.cause for each in found} <= set(SPOILS[name].causes), "; ".join(map(str, found))
    assert sorted(n for each in found for n in each.photos) == shot.chosen(count)


def test_photos_with_a_shadow_are_named(tmp_path):
    shot = shoot("cornell", Size(32, 32), 90)
    photos = SPOILS["shadow in three photos"].apply(shot, 0.5)
    found = found_in(photos, shot, tmp_path)
    assert found == [PhotosMisfit(tuple(shot.chosen(3)))]


def test_exposure_is_told_by_how_much(spoilt_by):
    (found,) = spoilt_by("photos at a quarter", 1)
    assert found.gain == pytest.approx(-0.75, abs=0.02)


def test_the_moment_of_a_motion_is_named(shot, spoilt_by):
    found, *_ = spoilt_by("camera moved, pixels", 0.3)
    assert found.photo == pytest.approx(shot.half, abs=3)
    assert found.pixels == pytest.approx(0.3, rel=0.3)


@pytest.mark.parametrize("camera", [Size(1080, 1920), Size(999, 1601), Size(8, 40_000)])
def test_large_cameras_are_sampled_the_same_way_when_turned(camera):
    for lines, side in zip(sampled_lines(camera), camera, strict=True):
        assert np.array_equal(side - 1 - lines[::-1], lines)
        assert len(lines) % PATCH == 0
    rows, columns = sampled_lines(camera)
    assert len(rows) * len(columns) < camera.pixels / 4


def test_black_at_the_lowest_level_is_not_clipped_where_photos_fit(shot, diagnosed):
    # A camera without an offset: only noise below black is lost.
    black = np.median(shot.photos[0])
    assert diagnosed(np.maximum(shot.photos.astype(float) - black, 0).astype(np.uint16)) == []


def test_a_sample_of_saturated_camera_pixels_tells_nothing(shot, diagnosed):
    photos = shot.photos.repeat(4, axis=1).repeat(4, axis=2)
    rows, columns = sampled_lines(Size(64, 64))
    assert len(rows) < 64
    lit = np.array([shot.plan.draw(number).any() for number in range(len(photos))])
    photos[np.ix_(lit, rows, columns)] = shot.full_scale
    assert diagnosed(photos) == []


def test_a_sample_holds_the_photos_at_its_places(shot):
    photos = np.arange(2 * 300 * 400, dtype=np.float32).reshape(2, 300, 400, 1)
    capture = SimpleNamespace(
        camera=Size(300, 400),
        channels=1,
        plan=SimpleNamespace(patterns=[None, None]),
        read=lambda numbers, rows: photos[numbers][:, rows],
    )
    sample = sample_camera(capture, lambda share: ignore_progress("", share))
    assert np.array_equal(sample.photos, photos[:, sample.rows][:, :, sample.columns])


@pytest.mark.parametrize(
    ("numbers", "other", "are_of_it"),
    [
        # Out of focus, fine patterns look alike.
        ((30, 31, 33), 25, False),
        # A projector that stands still.
        ((26, 27, 28), 25, True),
        ((22, 23, 24), 25, True),
        # One may be taken for another by its name.
        ((30, 33), 25, True),
        # It was dark.
        ((30, 31, 33), 0, True),
    ],
)
def test_many_photos_of_one_pattern_far_from_them_are_not_of_it(shot, numbers, other, are_of_it):
    explained = {number: Explanation("order", 1.0, other) for number in numbers}
    assert bool(single_photos.certain_ones(shot.plan, explained)) == are_of_it
