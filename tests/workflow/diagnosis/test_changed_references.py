"""What photos of white and black tell when they should be alike."""

from types import SimpleNamespace

import numpy as np
import pytest
from benchmarks.spoils import shoot

from nearfar.arrays import Size
from nearfar.faults.of_light import NoisyRows, RowsFlicker
from nearfar.faults.of_photos import PixelsFlash, SceneChanged
from nearfar.photometry.drift import find_references
from nearfar.photometry.drift_removal import remove_drift
from nearfar.photometry.in_memory import PhotosInMemory
from nearfar.workflow.diagnosis.changed_references import (
    find_changed_references,
    find_flashing_pixels,
)

CAMERA = Size(24, 24)
# Standard deviations of the noise of white and black.
NOISE = (0.004, 0.0005)


@pytest.fixture(scope="module")
def shot():
    shot = shoot("cornell", CAMERA, 80)
    photos = shot.photos.astype(np.float32) / np.float32(shot.full_scale)
    return SimpleNamespace(plan=shot.plan, photos=photos, references=find_references(shot.plan))


def found_in(shot, change=None, seed=0):
    """What is found in photos whose white and black are drawn anew and changed."""
    photos, rng = shot.photos.copy(), np.random.default_rng(seed)
    for numbers, noise in zip(shot.references, NOISE, strict=True):
        exact = shot.photos[numbers].mean(axis=0)
        photos[numbers] = exact + noise * rng.standard_normal((len(numbers), *exact.shape))
    if change is not None:
        change(photos)
    steady = remove_drift(PhotosInMemory(shot.plan, photos, 1.0))
    return [
        *find_flashing_pixels(steady, photos, shot.references),
        *find_changed_references(steady, shot.references),
    ]


@pytest.mark.parametrize("seed", range(20))
def test_noise_alone_changes_nothing(shot, seed):
    assert found_in(shot, seed=seed) == []


def test_drift_of_lamp_and_ambient_light_changes_nothing(shot):
    def drift(photos):
        shares = np.linspace(0, 1, len(photos))[:, None, None, None]
        photos *= 1 - 0.2 * shares
        photos += 0.03 * shares

    assert found_in(shot, drift) == []


@pytest.mark.parametrize("place", [1, 2, 3])
def test_a_darker_corner_is_found_between_two_photos(shot, place):
    whites = shot.references.whites

    def darken(photos):
        photos[whites[place] :, :6, :6] *= 0.9

    assert found_in(shot, darken) == [SceneChanged(whites[place - 1], whites[place])]


@pytest.mark.parametrize(("at_black", "kind"), [(0.0, RowsFlicker), (1.0, NoisyRows)])
def test_bands_of_rows_are_told_from_changes(shot, at_black, kind):
    def shade(photos):
        rows = np.random.default_rng(3).standard_normal(photos.shape[:2])
        photos[shot.references.whites] += 0.005 * rows[shot.references.whites][..., None, None]
        photos[shot.references.blacks] += (
            at_black * 0.005 * rows[shot.references.blacks][..., None, None]
        )

    (found,) = found_in(shot, shade)
    assert isinstance(found, kind)
    white = shot.photos[shot.references.whites].mean(axis=0)
    # Drift takes the mean of each photo's rows.
    assert found.deviation == pytest.approx(0.005 / np.sqrt(np.mean(white**2)), rel=0.25)


def test_columns_that_differ_are_no_bands(shot):
    def shade(photos):
        columns = np.random.default_rng(3).standard_normal((len(photos), photos.shape[2]))
        photos += 0.005 * columns[:, None, :, None]

    assert not any(isinstance(each, RowsFlicker | NoisyRows) for each in found_in(shot, shade))


def test_flashing_pixels_are_told_by_their_share_and_are_no_change(shot):
    def flash(photos):
        flashes = np.random.default_rng(3).random(photos.shape[:3]) < 0.005
        photos[flashes] += 0.2

    (found,) = found_in(shot, flash)
    assert isinstance(found, PixelsFlash)
    assert found.share == pytest.approx(0.005, rel=0.5)


@pytest.mark.parametrize("place", [0, -1])
def test_a_few_flashes_in_the_first_or_last_white_are_no_change(shot, place):
    def flash(photos):
        photos[shot.references.whites[place], 3:6, 3] += 0.3

    assert found_in(shot, flash) == []


def test_one_photo_with_flashes_is_something_else(shot):
    def flash(photos):
        photos[shot.references.whites[2], 3:5, 3:5] += 0.2

    assert not any(isinstance(each, PixelsFlash) for each in found_in(shot, flash))


@pytest.mark.parametrize("levels", [80, 255, 1000])
def test_photos_that_are_rounded_coarsely_do_not_flash(shot, levels):
    def round_coarsely(photos):
        photos[:] = np.rint(photos * levels) / levels

    assert not any(isinstance(each, PixelsFlash) for each in found_in(shot, round_coarsely))
