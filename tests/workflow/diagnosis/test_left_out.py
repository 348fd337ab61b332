"""What spoils photos of codes is told by name, though all codes are one measurement."""

import numpy as np
import pytest
from benchmarks.spoils import SPOILS, shoot
from scipy import ndimage

from nearfar.arrays import Size
from nearfar.capture.writing import write_capture
from nearfar.photometry.by_codes import find_codes
from nearfar.plan.patterns import LampCode
from nearfar.transport.stored import open_transport
from nearfar.workflow.diagnosis.diagnose import find_what_spoils
from nearfar.workflow.diagnosis.left_out import estimate_without
from nearfar.workflow.diagnosis.misfit import Fits, effects_on_code, fit_photos
from nearfar.workflow.diagnosis.sample import sample_camera
from nearfar.workflow.reconstruction.reconstruct import reconstruct_to_file


@pytest.fixture(scope="module")
def shot():
    found = shoot("cornell", Size(16, 16), 380)
    assert found.plan.is_by_codes
    return found


@pytest.fixture(scope="module")
def reconstructed(shot, tmp_path_factory):
    def reconstruct(photos):
        folder = tmp_path_factory.mktemp("spoilt")
        capture = write_capture(
            shot.plan, folder / "c.zarr", list(photos), full_scale=shot.full_scale
        )
        reconstruct_to_file(capture, folder / "t.zarr")
        return open_transport(folder / "t.zarr"), capture

    return reconstruct


def test_good_photos_of_codes_are_not_accused(shot, reconstructed):
    assert find_what_spoils(*reconstructed(shot.photos)) == []


@pytest.mark.parametrize(
    ("name", "strength"),
    [
        ("gamma", 1.1),
        ("camera moved, pixels", 0.2),
        ("projector moved, pixels", 0.2),
        ("projector out of focus, pixels", 1.0),
        ("photos swapped", 2),
        ("photos rotated", 1),
        ("photos mirrored", 1),
        ("photos doubled", 1),
        ("photos cut off", 1),
        ("lamp flickers", 0.05),
    ],
)
def test_what_spoils_photos_of_codes_is_named(shot, reconstructed, name, strength):
    found = find_what_spoils(*reconstructed(SPOILS[name].apply(shot, strength)))
    assert found[0].cause in SPOILS[name].causes


def test_neighbouring_codes_tell_what_a_projector_that_moves_or_blurs_changes(shot):
    plan, camera = shot.plan, (16, 16, 3)

    def picture(light):
        return np.asarray(shot.truth @ light.astype(np.float32)).reshape(camera)

    lights = [plan.draw(number) / 255 for number in range(len(plan.patterns))]
    number = list(find_codes(plan).rows)[50]
    relit = np.stack([picture(light) for light in lights])
    fits = Fits(relit, relit, np.ones_like(relit), np.zeros(camera), np.zeros(camera))
    by_row = {row: number for number, row in find_codes(plan).rows.items()}
    found = effects_on_code(fits, plan, plan.patterns[number], by_row)

    def shifted(*by):
        return picture(ndimage.shift(lights[number], by, order=1, mode="nearest"))

    expected = (
        (shifted(0.2, 0) - shifted(-0.2, 0)) / 0.4,
        (shifted(0, 0.2) - shifted(0, -0.2)) / 0.4,
        picture(lights[number]) - picture(ndimage.gaussian_filter(lights[number], 0.4)),
    )
    for one, other in zip(found, expected, strict=True):
        # All but at the projector's border.
        assert np.corrcoef(one.ravel(), other.ravel())[0, 1] > 0.97
    for one, other in zip(found[:2], expected[:2], strict=True):
        assert np.sum(one * other) / np.sum(one**2) == pytest.approx(1.0, abs=0.03)


def test_a_photo_that_is_left_out_has_no_part_in_the_estimate(shot, reconstructed):
    """Whatever it shows: the estimate is that of the others."""
    number = list(find_codes(shot.plan).rows)[100]
    assert isinstance(shot.plan.patterns[number], LampCode)
    pictures = []
    for shown in (shot.photos[number], shot.photos[number][::-1]):
        photos = list(shot.photos)
        photos[number] = shown
        stored, capture = reconstructed(photos)
        sample = sample_camera(capture, lambda _: None)
        estimate = sample.of_transport(stored)
        fits = fit_photos(sample.without_drift(), estimate)
        good = np.ones(len(shot.plan.patterns), dtype=bool)
        found = estimate_without(fits, good, [number], estimate.correspondence)
        light = shot.plan.draw(number) / np.float32(255)
        pictures.append(np.asarray(found @ light) + found.black)
    with_photo, with_another = pictures
    left, between = with_another - with_photo, shot.photos[number]
    scale = np.std(between[::-1] / shot.full_scale - between / shot.full_scale)
    # A tenth is left of what differs.
    assert np.std(left) < 0.1 * scale
