"""A camera that saturates below the full scale that it is said to have."""

import numpy as np
import pytest

from nearfar import choose_plan
from nearfar.arrays import Size
from nearfar.faults.of_photos import WhiteClipped
from nearfar.photometry.drift import find_references
from nearfar.workflow.diagnosis.clipped import find_clipped_white
from nearfar.workflow.diagnosis.sample import CameraSample

CAMERA = Size(40, 50)


@pytest.fixture(scope="module")
def plan():
    return choose_plan(Size(16, 16), 60)[0]


def sampled(plan, white, bits, noise=0.003):
    """Return a sample whose photos of white are a picture with noise, in whole levels."""
    generator = np.random.default_rng(0)
    photos = np.zeros((len(plan.patterns), *CAMERA, 1))
    whites = find_references(plan).whites
    photos[whites] = white[..., None]
    photos += noise * generator.standard_normal(photos.shape)
    top = 2**bits - 1
    taken = (np.rint(np.clip(photos, 0, 1) * top) / top).astype(np.float32)
    lines = (np.arange(side) for side in CAMERA)
    return CameraSample(plan, taken, *lines, CAMERA)


def bright(seed=0):
    return np.random.default_rng(seed).uniform(0.3, 0.9, CAMERA)


def limited(sample, level):
    return CameraSample(
        sample.plan, np.minimum(sample.photos, np.float32(level)), sample.rows, sample.columns,
        sample.camera,
    )  # fmt: skip


@pytest.mark.parametrize("bits", [12, 16])
@pytest.mark.parametrize("level", [0.85, 0.6])
def test_a_level_that_whites_do_not_exceed_is_told(plan, bits, level):
    sample = limited(sampled(plan, bright(), bits), level)
    (fault,) = find_clipped_white(sample)
    assert fault == WhiteClipped(pytest.approx((0.9 - level) / 0.6, abs=0.03), pytest.approx(level))
    assert f"{level:.1%} of full scale" in str(fault)


@pytest.mark.parametrize("bits", [8, 12, 16])
def test_without_such_a_level_nothing_is_told(plan, bits):
    assert find_clipped_white(sampled(plan, bright(), bits)) == []
    # A wall that is bright all over, in few levels, almost without noise.
    even = np.full(CAMERA, 0.8)
    assert find_clipped_white(sampled(plan, even, bits)) == []
    assert find_clipped_white(sampled(plan, even, bits, noise=0.0)) == []
    # The same before a scene of many levels: one level of the wall says nothing.
    wall = bright()
    wall[:20] = 0.95
    assert find_clipped_white(sampled(plan, wall, bits, noise=0.0001)) == []
    slope = np.linspace(0.2, 0.8, CAMERA.width) + np.zeros(CAMERA)
    assert find_clipped_white(sampled(plan, slope, bits, noise=0.0005)) == []


def test_a_few_that_read_the_highest_level_are_no_limit(plan):
    # Such as stuck ones: no more of them than there are at any other level.
    white = bright()
    white.ravel()[:10] = 0.0
    sample = sampled(plan, white, 8)
    sample.photos.reshape(len(sample.photos), -1)[:, :10] = sample.photos.max()
    assert find_clipped_white(sample) == []


def test_what_is_at_full_scale_is_known_already(plan):
    assert find_clipped_white(sampled(plan, 1.5 * bright(), 12)) == []
