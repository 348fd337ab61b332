"""Photos that were not transferred whole are told by rows of one value."""

import numpy as np
import pytest

from nearfar.faults.of_single_photos import PhotosIncomplete
from nearfar.workflow.diagnosis.incomplete import find_incomplete

BLACKS = np.array([0, 9])


@pytest.fixture
def photos():
    generator = np.random.default_rng(0)
    return np.round(generator.uniform(0.1, 0.9, (12, 24, 16, 1)), 3).astype(np.float32)


def test_photos_whose_rest_is_of_one_value_are_named(photos):
    assert find_incomplete(photos, BLACKS) == []
    photos[5, 12:] = 0.0
    photos[7] = 0.5
    assert find_incomplete(photos, BLACKS) == [PhotosIncomplete((5, 7))]
    assert "photos 5, 7 are incomplete" in str(PhotosIncomplete((5, 7)))
    assert "shoot it again" in str(PhotosIncomplete((5,)))


def test_black_that_is_clipped_and_light_at_full_scale_are_not(photos):
    # The dark half of a half-screen is clipped where black is.
    photos[BLACKS] = photos[3, 12:] = 0.0
    assert find_incomplete(photos, BLACKS) == []
    photos[1:9, :6] = 1.0
    assert find_incomplete(photos, BLACKS) == []


def test_few_columns_tell_nothing(photos):
    photos[5, 12:] = 0.0
    assert find_incomplete(photos[:, :, :4], BLACKS) == []
