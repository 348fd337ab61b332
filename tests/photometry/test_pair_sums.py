"""What inverse pairs sum to."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.photometry.in_memory import PhotosInMemory
from nearfar.photometry.pair_sums import below_full_scale, sum_pairs
from nearfar.plan import paper_plan

PROJECTOR = Size(8, 8)
GAIN, FLOOR = 1e-4, 4e-6


def _photos(drift=0.0, window=5, black_level=0.0):
    """Photograph a diagonal T of 40 x 30 camera pixels with shot and read noise."""
    plan = paper_plan(PROJECTOR, window, (3, 3), correspondence="none")
    generator = np.random.default_rng(0)
    white = generator.uniform(0.2, 0.8, (40, 30))
    seen = generator.integers(0, PROJECTOR.pixels, white.shape)
    count = len(plan.patterns)
    patterns = np.stack([plan.draw(i) / 255.0 for i in range(count)]).reshape(count, -1)
    lamp = 1 + drift * np.linspace(-0.5, 0.5, count)[:, None, None]
    clean = 0.05 + lamp * white * patterns[:, seen]
    photos = clean + np.sqrt(GAIN * clean + FLOOR) * generator.normal(size=clean.shape)
    return PhotosInMemory(plan, (photos + black_level)[..., None].astype(np.float32), 1.0)


@pytest.mark.parametrize("drift", [0.0, 0.05])
@pytest.mark.parametrize("bands", [[slice(0, 40)], [slice(0, 8), slice(16, 40)]])
def test_noise_is_told_apart_from_drift(drift, bands):
    found = sum_pairs(_photos(drift), bands)
    levels = np.array([[0.1], [0.4], [0.8]])
    expected = GAIN * levels + FLOOR
    np.testing.assert_allclose(found.variance(levels), expected, rtol=0.15)
    assert found.scatter == pytest.approx(1.0, abs=0.1)
    assert np.ptp(found.light) == pytest.approx(0.9 * drift, abs=0.005)


def test_the_variance_of_few_pairs_is_not_too_small():
    photos = _photos(window=2)
    pairs = len(photos.plan.patterns) // 2
    assert pairs < 13
    found = sum_pairs(photos, [slice(0, 40)])
    levels = photos.photos.mean(axis=0).reshape(-1, 1)
    # The model and what the sums scatter beyond it are together what they scatter.
    shown = found.scatter * found.variance(levels).mean()
    deviation = np.sqrt(2 / ((pairs - 1) * len(levels)))
    assert shown == pytest.approx((GAIN * levels + FLOOR).mean(), rel=4 * deviation)
    assert 4 * deviation < 1 / pairs


def test_a_black_level_has_no_shot_noise():
    found = sum_pairs(_photos(black_level=0.1), [slice(0, 40)])
    levels = np.array([[0.2], [0.5], [0.9]])
    np.testing.assert_allclose(found.variance(levels), GAIN * (levels - 0.1) + FLOOR, rtol=0.15)


def test_a_dark_pair_and_dark_rows_do_no_harm():
    photos = _photos()
    dark = photos.photos.copy()
    dark[4:6] = 0.0
    dark[:, :8] = 0.0
    found = sum_pairs(PhotosInMemory(photos.plan, dark, 1.0), [slice(0, 8), slice(8, 40)])
    assert found.light[2] == 1.0
    assert np.isfinite(found.variance(np.ones((3, 1)))).all()


@pytest.mark.parametrize("rows", [2, 12])
def test_saturated_camera_pixels_count_for_nothing(rows):
    photos = _photos()
    saturated = photos.photos.copy()
    saturated[:, :rows] *= 4.0
    saturated = np.minimum(saturated, 1.0)
    assert (saturated == 1.0).any()
    found = sum_pairs(PhotosInMemory(photos.plan, saturated, 1.0), [slice(0, 40)])
    assert found.scatter == pytest.approx(1.0, abs=0.1)
    levels = np.array([[0.1], [0.4], [0.8]])
    np.testing.assert_allclose(found.variance(levels), GAIN * levels + FLOOR, rtol=0.15)


def test_a_channel_that_is_all_saturated_does_no_harm():
    photos = _photos()
    both = np.concatenate([photos.photos, np.ones_like(photos.photos)], axis=-1)
    found = sum_pairs(PhotosInMemory(photos.plan, both, 1.0), [slice(0, 40)])
    variance = found.variance(np.full((1, 2), 0.4))
    assert variance[0, 0] == pytest.approx(GAIN * 0.4 + FLOOR, rel=0.15)
    assert np.isfinite(variance).all()


def test_a_value_at_full_scale_in_any_photo_of_white_is_saturated():
    taken = np.full((2, 3, 2, 1), 0.5)
    taken[0, 0, 1] = taken[1, 2, 0] = 1.0
    photos = PhotosInMemory(_photos().plan, taken, 1.0)
    assert below_full_scale(photos, [0, 1], slice(0, 3)).ravel().tolist() == [1, 0, 1, 1, 0, 1]
    assert below_full_scale(photos, [0, 1], slice(1, 3)).ravel().tolist() == [1, 1, 0, 1]
    assert below_full_scale(photos, [], slice(0, 3)).all()


def test_the_light_of_a_pair_is_its_mean_over_all_rows():
    photos = _photos()
    taken = photos.photos.copy()
    taken[6:8, :8] *= 0.5
    found = sum_pairs(PhotosInMemory(photos.plan, taken, 1.0), [slice(0, 8), slice(16, 40)])
    rows = np.r_[0:8, 16:40]
    light = taken[::2][:, rows].sum(axis=(1, 2, 3)) + taken[1::2][:, rows].sum(axis=(1, 2, 3))
    np.testing.assert_allclose(found.light, light / light.mean(), rtol=1e-4)


def test_what_moves_at_a_few_camera_pixels_scatters_and_is_no_noise():
    photos = _photos()
    taken = photos.photos.astype(np.float64)
    generator = np.random.default_rng(1)
    moving = generator.random(taken.shape[1:]) < 0.05
    quiet = 2 * np.mean(GAIN * (0.05 + 0.25) + FLOOR)
    taken[::2, moving] += np.sqrt(20 * quiet) * generator.normal(size=taken[::2, moving].shape)
    found = sum_pairs(PhotosInMemory(photos.plan, taken, 1.0), [slice(0, 40)])
    assert found.scatter == pytest.approx(1 + 20 * moving.mean(), rel=0.1)
    levels = np.array([[0.1], [0.4], [0.8]])
    np.testing.assert_allclose(found.variance(levels), GAIN * levels + FLOOR, rtol=0.15)
