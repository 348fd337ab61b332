"""Transports for lights of blocks of projector pixels."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.illumination.frequencies import CHECKERBOARD, far_frequencies, representatives
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import real_basis
from nearfar.transport.coarse import block_means, in_blocks, size_in_blocks
from nearfar.transport.model import Transport

PROJECTOR, CAMERA = Size(96, 128), Size(9, 12)
BASIS = NearBasis(5, 8)


def _transport(projector):
    draw = np.random.default_rng(2)
    # Windows and footprints stay within the projector.
    sides = (np.linspace(28, side - 29, n) for side, n in zip(projector, CAMERA, strict=True))
    q = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1) + draw.uniform(0, 1, (*CAMERA, 2))
    q[2, 3] = np.nan
    far = real_basis(
        [*representatives(far_frequencies(Size(5, 7), projector)), CHECKERBOARD], projector
    )
    shape = (*CAMERA, 2)
    lit = np.isfinite(q[..., :1])
    nothing = np.zeros(shape, dtype=np.float32)
    return Transport(
        projector=projector,
        correspondence=q.astype(np.float32),
        direct=(draw.random(shape) * lit).astype(np.float32),
        near=(draw.random((*shape, BASIS.count)) * lit[..., None]).astype(np.float32),
        far=draw.normal(size=(*shape, far.count)).astype(np.float32),
        far_basis=far,
        black=nothing,
        noise=nothing,
        pitch=BASIS.pitch,
        footprint=(draw.random((*CAMERA, 4)) * [6.0, 5.0, 2.0, 3.0]).astype(np.float32),
    )


def _enlarged(light, side):
    return np.repeat(np.repeat(light, side, axis=0), side, axis=1)


@pytest.mark.parametrize("side", [1, 2, 4])
@pytest.mark.parametrize("channels", [1, 2])
def test_direct_and_far_range_light_of_blocks_is_exact(side, channels):
    transport = _transport(PROJECTOR)
    coarse = in_blocks(transport, side)
    assert coarse.projector == size_in_blocks(PROJECTOR, side) == Size(96 // side, 128 // side)
    light = np.random.default_rng(side).random((*coarse.projector, channels), dtype=np.float32)
    light = light[..., 0] if channels == 1 else light
    fine = _enlarged(light, side)
    expected, found = transport.components(fine), coarse.components(light)
    np.testing.assert_allclose(found.direct, expected.direct, atol=1e-5)
    # A light of blocks has nothing at the checkerboard, which blocks cannot show.
    np.testing.assert_allclose(found.far, expected.far, atol=3e-5)
    assert np.abs(expected.far).max() > 0.1


@pytest.mark.parametrize("side", [2, 4])
def test_near_range_light_is_kept_and_hardly_moved(side):
    transport = _transport(PROJECTOR)
    coarse = in_blocks(transport, side)
    white = np.ones(coarse.projector, dtype=np.float32)
    floodlit = transport.near.sum(axis=-1)
    np.testing.assert_allclose(coarse.components(white).near, floodlit, rtol=1e-5)
    # Along a ramp, light that moves by a block is off by a block's step.
    for axis, length in enumerate(coarse.projector):
        steps = np.arange(length, dtype=np.float32).reshape((-1, 1) if axis == 0 else (1, -1))
        ramp = np.broadcast_to(steps / length, coarse.projector).copy()
        fine = transport.components(_enlarged(ramp, side)).near
        assert (np.abs(coarse.components(ramp).near - fine) <= floodlit / length + 1e-5).all()


def test_blocks_that_the_border_cuts_are_means_of_what_is_there():
    draw = np.random.default_rng(0)
    light = draw.random((7, 10, 3), dtype=np.float32)
    means = block_means(light, 4)
    assert means.shape == (2, 3, 3)
    np.testing.assert_allclose(means[1, 2], light[4:, 8:].mean(axis=(0, 1)), rtol=1e-6)
    np.testing.assert_allclose(means[0, 1], light[:4, 4:8].mean(axis=(0, 1)), rtol=1e-6)
    transport = _transport(Size(98, 129))
    coarse = in_blocks(transport, 4)
    assert coarse.projector == Size(25, 33)
    light = draw.random(coarse.projector, dtype=np.float32)
    light[-1] = light[:, -1] = 0
    fine = _enlarged(light, 4)[:98, :129]
    expected, found = transport.components(fine), coarse.components(light)
    np.testing.assert_allclose(found.direct, expected.direct, atol=1e-5)
    np.testing.assert_allclose(found.far, expected.far, atol=3e-5)


def test_only_the_camera_pixels_lit_directly_have_near_range_light():
    transport = replace(_transport(PROJECTOR), posterior=None)
    light = np.ones(Size(24, 32), dtype=np.float32)
    parts = in_blocks(transport, 4).components(light)
    assert not parts.direct[2, 3].any()
    assert not parts.near[2, 3].any()
    assert parts.far[2, 3].any()
