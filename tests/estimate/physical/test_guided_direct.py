"""Direct light without speckle on translucent bodies, on small splits that are known."""

import numpy as np
import pytest

from nearfar.estimate.physical.guided_direct import with_guided_direct_light
from nearfar.estimate.physical.local_fits import guided_about, planes_about
from nearfar.illumination.pictures import random_pattern
from tests.estimate.physical.even import CAMERA, EVERYWHERE, PROJECTOR, WHITE, wax

DIRECT, UNDER, REST = 0.2, 0.3, 0.1
Y, X = np.mgrid[: CAMERA.height, : CAMERA.width]
INNER = (slice(2, -2), slice(2, -2))
# Of a body that kernels explain well, and badly.
WELL, BADLY = 1.0, 0.7


def guided(split, deviation=0.0):
    """Return components under white of the split and of the guided one, and that one."""
    found = with_guided_direct_light(split, np.full((*CAMERA, 1), deviation))
    return split.components(WHITE), found.components(WHITE), found


def speckle(scale, seed=3):
    return np.random.default_rng(seed).normal(0.0, scale, CAMERA)


def test_speckle_goes_from_both_and_the_sum_stays():
    error = speckle(0.02)
    before, after, found = guided(wax(DIRECT + error, UNDER - error, REST, explained=BADLY))
    for part, truth in (("direct", DIRECT), ("subsurface", UNDER)):
        was, now = (np.std(getattr(one, part)[INNER] - truth) for one in (before, after))
        assert now < 0.6 * was, part
    np.testing.assert_allclose(after.interreflection, before.interreflection, atol=1e-6)
    for light in (WHITE, random_pattern(PROJECTOR, 1)):
        total = sum(found.components(light))
        np.testing.assert_allclose(total, found.transport @ light, atol=1e-6)


def test_edges_of_a_texture_stay_as_sharp_as_they_are():
    texture = np.where((Y // 2 + X // 3) % 2 == 0, 1.0, 0.4)
    split = wax(DIRECT * texture, np.full(CAMERA, UNDER), REST, explained=BADLY)
    before, after, _ = guided(split)
    np.testing.assert_allclose(after.direct[INNER], before.direct[INNER], atol=2e-3)


def test_speckle_goes_from_a_texture_too():
    texture = np.where((Y // 2 + X // 3) % 2 == 0, 1.0, 0.4)
    error = speckle(0.02)
    split = wax(DIRECT * texture + error, UNDER - error, REST, explained=BADLY)
    before, after, _ = guided(split)
    was, now = (np.std((one.direct - DIRECT * texture)[INNER]) for one in (before, after))
    assert now < 0.7 * was


def test_no_light_is_moved_on_average():
    error = speckle(0.03, seed=5) * (1 + X / CAMERA.width)
    before, after, _ = guided(wax(DIRECT + error, UNDER - error, REST, explained=BADLY))
    moved = after.direct - before.direct
    assert np.abs(moved).max() > 0.005
    assert abs(moved[INNER].mean()) < 0.03 * np.abs(moved[INNER]).mean()


def test_components_that_are_sure_stay_as_they_are():
    error = speckle(0.02)
    before, after, _ = guided(wax(DIRECT + error, UNDER - error, REST, explained=WELL))
    apart, sure = (np.std(one.direct[INNER]) for one in (before, after))
    assert sure > 0.9 * apart


def test_photos_of_any_exposure_are_guided_alike():
    error = speckle(0.02, seed=6)
    parts = (DIRECT + error, UNDER - error, np.full(CAMERA, REST))
    bright, dark = (
        guided(wax(*(exposure * part for part in parts), explained=BADLY))[1]
        for exposure in (1.0, 0.05)
    )
    for one, other in zip(bright, dark, strict=True):
        np.testing.assert_allclose(0.05 * one, other, rtol=2e-3, atol=1e-7)


def test_nothing_becomes_negative_and_other_surfaces_stay():
    seen = CAMERA.width // 2 > X
    error = np.abs(speckle(0.3, seed=8))
    split = wax(0.02 + error, 0.02 + error[::-1], REST, explained=BADLY, seen=seen)
    before, after, _ = guided(split, deviation=0.5)
    assert after.direct.min() >= -1e-7
    assert after.subsurface.min() >= -1e-7
    for was, now in zip(before, after, strict=True):
        np.testing.assert_array_equal(now[~seen], was[~seen])


def test_values_that_go_with_the_guide_are_told_exactly():
    generator = np.random.default_rng(0)
    guide = generator.uniform(0.2, 1.0, CAMERA)
    values = np.stack([0.3 * guide + 0.1, -0.2 * guide], axis=-1)
    pixels = np.flatnonzero(EVERYWHERE)
    fit = guided_about(values, guide, EVERYWHERE, pixels)
    told = fit.value.reshape(*CAMERA, 2)
    np.testing.assert_allclose(told[INNER], values[INNER], atol=1e-3)
    by_planes = planes_about(values, EVERYWHERE, pixels)
    assert np.all(fit.left <= by_planes.left + 1e-9)
    assert by_planes.left.reshape(CAMERA)[INNER].min() > 100 * fit.left.reshape(CAMERA)[INNER].max()


@pytest.mark.parametrize("guide", [0.0, 0.7])
def test_an_even_guide_tells_what_planes_tell(guide):
    values = np.random.default_rng(1).uniform(size=(*CAMERA, 1))
    pixels = np.flatnonzero(EVERYWHERE)
    seen = np.random.default_rng(2).uniform(size=CAMERA) < 0.6
    one = guided_about(values, np.full(CAMERA, guide), seen, pixels)
    for mine, other in zip(one, planes_about(values, seen, pixels), strict=True):
        np.testing.assert_allclose(mine, other, atol=1e-9)


def test_a_camera_pixel_without_others_is_told_0():
    seen = np.zeros(CAMERA, bool)
    seen[3, 3] = True
    pixels = np.flatnonzero(seen)
    values = np.ones((*CAMERA, 1))
    for fit in (
        planes_about(values, seen, pixels),
        guided_about(values, np.ones(CAMERA), seen, pixels),
    ):
        assert not fit.value.any()
        assert fit.number == 0
