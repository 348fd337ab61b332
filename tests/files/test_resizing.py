"""Lights of another size than the projector: refused, or resized when asked."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.files.resizing import resize_light


@pytest.mark.parametrize("shape", [(12, 20), (7, 9), (5, 40, 3)])
@pytest.mark.parametrize("size", [Size(6, 10), Size(24, 40), Size(1, 1), Size(11, 13)])
def test_a_resized_light_has_the_same_mean_and_range(shape, size):
    light = np.random.default_rng(0).random(shape).astype(np.float32)
    resized = resize_light(light, size)
    assert resized.shape == (*size, *shape[2:])
    np.testing.assert_allclose(resized.mean(axis=(0, 1)), light.mean(axis=(0, 1)), rtol=1e-5)
    assert light.min() - 1e-6 <= resized.min() <= resized.max() <= light.max() + 1e-6


def test_blocks_go_there_and_back():
    light = np.random.default_rng(1).random((5, 7)).astype(np.float32)
    blocks = light.repeat(3, axis=0).repeat(2, axis=1)
    np.testing.assert_allclose(resize_light(light, Size(15, 14)), blocks, rtol=1e-5)
    np.testing.assert_allclose(resize_light(blocks, Size(5, 7)), light, rtol=1e-5)
