"""JPEG is told from photos alone, at every quality, wherever the photos were cut."""

import io

import numpy as np
import pytest
from PIL import Image
from scipy import ndimage

from nearfar.arrays import Size
from nearfar.capture.writing import write_capture
from nearfar.photometry.drift import find_references
from nearfar.plan import choose_plan
from nearfar.workflow.diagnosis.compression import find_compression
from nearfar.workflow.diagnosis.misfit import is_white_or_black

CAMERA = Size(43, 61)


def pictures(channels, *, contrast=40.0):
    """Return photos of 8 bits with structure and noise."""
    random = np.random.default_rng(0)
    plan, _ = choose_plan(Size(8, 8), 24)
    shape = (len(plan.patterns), *CAMERA, channels)
    smooth = ndimage.gaussian_filter(random.standard_normal(shape), (0, 3, 3, 0))
    smooth *= contrast / smooth.std()
    photos = 100 + smooth + random.standard_normal(shape)
    whites, blacks = find_references(plan)
    photos[whites], photos[blacks] = 200, 5
    return plan, np.clip(photos, 0, 255).round().astype(np.uint8)


def as_jpeg(photo, quality):
    stored = io.BytesIO()
    picture = photo[..., 0] if photo.shape[2] == 1 else photo
    Image.fromarray(picture).save(stored, "JPEG", quality=quality)
    return np.asarray(Image.open(stored)).reshape(photo.shape)


def compressed(folder, plan, photos, **options):
    capture = write_capture(plan, folder / "c.zarr", list(photos), **options)
    return find_compression(capture, ~is_white_or_black(plan))


@pytest.mark.parametrize("quality", [60, 85, 95, 99, 100])
@pytest.mark.parametrize("channels", [1, 3])
def test_jpeg_is_found(tmp_path, channels, quality):
    plan, photos = pictures(channels)
    photos = np.stack([as_jpeg(photo, quality) for photo in photos])
    assert compressed(tmp_path, plan, photos)


@pytest.mark.parametrize("channels", [1, 3])
def test_jpeg_that_was_cut_and_stretched_to_more_bits_is_found(tmp_path, channels):
    plan, photos = pictures(channels)
    photos = np.stack([as_jpeg(photo, 95) for photo in photos])[:, 3:, 5:]
    stretched = np.rint(photos * (4095 / 255)).astype(np.uint16)
    assert compressed(tmp_path, plan, stretched, full_scale=4095)


@pytest.mark.parametrize("contrast", [0.0, 5.0, 40.0, 150.0])
@pytest.mark.parametrize("channels", [1, 3])
def test_photos_of_8_bits_are_not_accused(tmp_path, channels, contrast):
    plan, photos = pictures(channels, contrast=contrast)
    assert not compressed(tmp_path, plan, photos)


def test_photos_of_more_bits_and_flat_ones_are_not_accused(tmp_path):
    plan, photos = pictures(3)
    noise = np.random.default_rng(1).integers(0, 16, photos.shape)
    photos = photos.astype(np.uint16) * 16 + noise.astype(np.uint16)
    assert not compressed(tmp_path, plan, photos, full_scale=4095)


def test_a_camera_smaller_than_a_block_tells_nothing(tmp_path):
    plan, photos = pictures(3)
    assert not compressed(tmp_path, plan, photos[:, :5, :4])


def test_a_plan_of_white_and_black_alone_tells_nothing(tmp_path):
    plan, photos = pictures(1)
    capture = write_capture(plan, tmp_path / "c.zarr", list(photos))
    assert not find_compression(capture, np.zeros(len(photos), dtype=bool))
