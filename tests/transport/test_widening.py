"""Blurring by hats, each from the hat that is half as wide."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.illumination.near_basis import NearBasis
from nearfar.transport.pyramid import Pyramid
from nearfar.transport.widening import widen

PROJECTOR = Size(37, 300)


def _by_hats(light, pitch):
    """Blur by hats of a sum of 1, written out along each axis; dark beyond the border."""
    for axis, length in enumerate(light.shape):
        places = np.arange(length)
        hats = np.maximum(0.0, 1.0 - np.abs(places[:, None] - places) / pitch) / pitch
        light = np.moveaxis(np.tensordot(hats, light, axes=(1, axis)), 0, axis)
    return light


@pytest.mark.parametrize("lit", [(slice(None), slice(None)), (slice(0, 3), slice(290, 300))])
def test_levels_are_the_light_blurred_by_each_hat(lit):
    light = np.zeros(PROJECTOR)
    light[lit] = np.random.default_rng(0).random(light[lit].shape)
    pyramid = Pyramid(NearBasis(3, 16), PROJECTOR)
    levels = pyramid.levels(light).reshape(pyramid.shape)
    around = pyramid.margin
    for level, pitch in zip(levels, (1, 2, 4, 8, 16), strict=True):
        inside = level[around:-around, around:-around]
        np.testing.assert_allclose(inside, _by_hats(light, pitch), atol=1e-12)
        # What the hat carries beyond the border is kept, as camera pixels near it see that.
        assert level.sum() == pytest.approx(light.sum())


def test_spread_is_the_adjoint_of_levels():
    pyramid, draw = Pyramid(NearBasis(5, 8), PROJECTOR), np.random.default_rng(1)
    light, values = draw.random(PROJECTOR), draw.random(int(np.prod(pyramid.shape)))
    forward = pyramid.levels(light) @ values
    assert np.sum(light * pyramid.spread(values.copy())) == pytest.approx(forward, rel=1e-12)


def test_blocks_of_rows_are_those_of_the_whole():
    light = np.random.default_rng(2).random((700, 40)).astype(np.float32)
    whole, part = np.zeros_like(light), np.zeros_like(light)
    widen(light, 4, (slice(None), slice(None)), whole)
    widen(light, 4, (slice(100, 600), slice(5, 33)), part)
    np.testing.assert_array_equal(part[100:600, 5:33], whole[100:600, 5:33])
    assert not part[:100].any()
    assert not part[:, 33:].any()
