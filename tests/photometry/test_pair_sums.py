"""What inverse pairs sum to."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.photometry.in_memory import PhotosInMemory
from nearfar.photometry.pair_sums import sum_pairs
from nearfar.plan import paper_plan

PROJECTOR = Size(8, 8)
GAIN, FLOOR = 1e-4, 4e-6


def _photos(drift=0.0):
    """Photograph a diagonal T of 40 x 30 camera pixels with shot and read noise."""
    plan = paper_plan(PROJECTOR, 5, (3, 3), correspondence="none")
    generator = np.random.default_rng(0)
    white = generator.uniform(0.2, 0.8, (40, 30))
    seen = generator.integers(0, PROJECTOR.pixels, white.shape)
    count = len(plan.patterns)
    patterns = np.stack([plan.draw(i) / 255.0 for i in range(count)]).reshape(count, -1)
    lamp = 1 + drift * np.linspace(-0.5, 0.5, count)[:, None, None]
    clean = 0.05 + lamp * white * patterns[:, seen]
    photos = clean + np.sqrt(GAIN * clean + FLOOR) * generator.normal(size=clean.shape)
    return PhotosInMemory(plan, photos[..., None].astype(np.float32), 1.0)


@pytest.mark.parametrize("drift", [0.0, 0.05])
@pytest.mark.parametrize("bands", [[slice(0, 40)], [slice(0, 8), slice(16, 40)]])
def test_noise_is_told_apart_from_drift(drift, bands):
    found = sum_pairs(_photos(drift), bands)
    levels = np.array([[0.1], [0.4], [0.8]])
    expected = GAIN * levels + FLOOR
    np.testing.assert_allclose(found.variance(levels), expected, rtol=0.15)
    assert found.scatter == pytest.approx(1.0, abs=0.1)
    assert np.ptp(found.light) == pytest.approx(0.9 * drift, abs=0.005)


def test_a_dark_pair_and_dark_rows_do_no_harm():
    photos = _photos()
    dark = photos.photos.copy()
    dark[4:6] = 0.0
    dark[:, :8] = 0.0
    found = sum_pairs(PhotosInMemory(photos.plan, dark, 1.0), [slice(0, 8), slice(8, 40)])
    assert found.light[2] == 1.0
    assert np.isfinite(found.variance(np.ones((3, 1)))).all()


def test_saturated_camera_pixels_count_for_nothing():
    photos = _photos()
    saturated = photos.photos.copy()
    saturated[:, :2] *= 4.0
    saturated = np.minimum(saturated, 1.0)
    assert (saturated == 1.0).any()
    found = sum_pairs(PhotosInMemory(photos.plan, saturated, 1.0), [slice(0, 40)])
    assert found.scatter == pytest.approx(1.0, abs=0.1)
    levels = np.array([[0.1], [0.4], [0.8]])
    np.testing.assert_allclose(found.variance(levels), GAIN * levels + FLOOR, rtol=0.15)
