"""Inter-reflection that is smooth on translucent bodies, on small splits that are known."""

import numpy as np
import pytest

from nearfar.estimate.physical.smooth_bodies import with_smooth_bodies
from nearfar.illumination.pictures import random_pattern
from tests.estimate.physical.even import (
    CAMERA,
    PROJECTOR,
    WHITE,
    of_both_channels,
    split_of,
    wax,
)

DIRECT, UNDER, REST = 0.2, 0.3, 0.1
Y, X = np.mgrid[: CAMERA.height, : CAMERA.width]
# Of a body that kernels explain well, and badly.
WELL, BADLY = 1.0, 0.7


def smoothed(split, deviation=0.0):
    """Return components under white of the split and of the smoothed one."""
    found = with_smooth_bodies(split, np.full((*CAMERA, 1), deviation))
    return split.components(WHITE), found.components(WHITE), found


def test_errors_of_single_camera_pixels_leave_inter_reflection():
    error = np.random.default_rng(3).normal(0.0, 0.015, CAMERA)
    split = wax(DIRECT, UNDER + error, REST - error, explained=BADLY)
    before, after, found = smoothed(split)
    inner = (slice(2, -2), slice(2, -2))
    for part, left in (("subsurface", 0.7), ("interreflection", 0.4)):
        was, now = (np.std(getattr(one, part)[inner]) for one in (before, after))
        assert now < left * was, part
    for light in (WHITE, random_pattern(PROJECTOR, 1)):
        total = sum(found.components(light))
        np.testing.assert_allclose(total, split.transport @ light, atol=1e-6)


def test_shares_that_change_evenly_stay_as_they_are():
    total = 0.4 + 0.2 * (X % 3 == 0)
    share = 0.1 + 0.01 * Y + 0.005 * X
    split = wax(0.3 * total, (0.7 - share) * total, share * total, explained=BADLY)
    before, after, _ = smoothed(split)
    inner = (slice(2, -2), slice(2, -2))
    for was, now in zip(before, after, strict=True):
        np.testing.assert_allclose(now[inner], was[inner], atol=1e-5)


def test_at_an_outline_shares_keep_most_of_an_even_change():
    change = 0.02
    share = 0.1 + change * X
    before, after, _ = smoothed(wax(0.2, 0.8 - share, share, explained=BADLY))
    # The camera pixels that tell of the outermost are 1.25 columns from it in the mean.
    lost = after.interreflection[2:-2, 0] - before.interreflection[2:-2, 0]
    assert np.all(np.abs(lost) < 0.6 * 1.25 * change)


def test_photos_of_any_exposure_are_smoothed_alike():
    error = np.random.default_rng(6).normal(0.0, 0.02, CAMERA)
    parts = (np.full(CAMERA, DIRECT), UNDER + error, REST - error)
    bright, dark = (
        smoothed(wax(*(exposure * part for part in parts), explained=BADLY))[1]
        for exposure in (1.0, 0.05)
    )
    for one, other in zip(bright, dark, strict=True):
        np.testing.assert_allclose(0.05 * one, other, rtol=1e-3)


def test_what_error_bars_do_not_explain_stays():
    texture = np.where((X + Y) % 2, 0.04, -0.04)
    before, after, _ = smoothed(wax(DIRECT, UNDER, REST + texture, explained=WELL))
    np.testing.assert_allclose(after.interreflection, before.interreflection, atol=0.004)
    # One camera pixel among others that are alike stands out no less.
    one = np.zeros(CAMERA)
    one[6, 6] = 0.3
    before, after, _ = smoothed(wax(DIRECT, UNDER, REST + one, explained=WELL))
    np.testing.assert_allclose(after.interreflection[6, 6], before.interreflection[6, 6], rtol=0.1)


@pytest.mark.parametrize(("deviation", "of_error"), [(1.0, 0.02), (0.0, 0.002)])
def test_the_part_that_is_less_sure_takes_most(deviation, of_error):
    error = np.random.default_rng(4).normal(0.0, of_error, CAMERA)
    before, after, _ = smoothed(wax(DIRECT, UNDER, REST + error, explained=WELL), deviation)
    to_direct, to_under, lost = (
        np.linalg.norm(now - was) for now, was in zip(after, before, strict=True)
    )
    assert lost > 0.5 * np.linalg.norm(error)
    # Kernels that explain all tell direct light better than the subsurface light beside it.
    assert (to_direct if deviation else to_under) > 0.8 * lost


def test_camera_pixels_beside_a_body_and_few_of_them_stay_as_they_are():
    error = np.random.default_rng(5).normal(0.0, 0.03, CAMERA)
    line = (Y == 6) & (X < 5)
    split = wax(DIRECT, UNDER, REST + error, explained=BADLY, seen=line)
    before, after, _ = smoothed(split, 0.1)
    for was, now in zip(before, after, strict=True):
        np.testing.assert_array_equal(now, was)
    half = X < 6
    split = wax(DIRECT, UNDER, REST + error, explained=BADLY, seen=half)
    before, after, _ = smoothed(split, 0.1)
    for was, now in zip(before, after, strict=True):
        np.testing.assert_array_equal(now[~half], was[~half])
    assert np.std(after.interreflection[half]) < 0.7 * np.std(before.interreflection[half])


def test_no_component_becomes_negative():
    error = np.where((Y == 6) & (X == 6), -0.09, 0.0)
    split = wax(0.01, 0.02, REST + error, explained=0.0)
    before, after, _ = smoothed(split, 1.0)
    assert after.direct.min() >= 0.0
    assert after.subsurface.min() > 0.0
    assert after.interreflection[6, 6] > before.interreflection[6, 6] + 0.005


def test_subsurface_light_of_a_channel_that_has_little_of_it_stays_above_zero():
    """Channels are smoothed alike, by what error bars of all of them explain."""
    one = np.where((Y == 6) & (X == 6), 0.2, 0.0)
    bright = wax(DIRECT, 1.0, REST, explained=0.0)
    dim = wax(0.5, 0.01, 0.3 - one, explained=0.0)
    bodies = [each.bodies[0] for each in (bright, dim)]
    body = bodies[0]._replace(
        sources=sum((each.sources for each in bodies), ()),
        amplitude=np.concatenate([each.amplitude for each in bodies], axis=1),
    )
    split = split_of(of_both_channels(bright.transport, dim.transport), body)
    found = with_smooth_bodies(split, np.zeros((*CAMERA, 2)))
    assert found.components(WHITE).subsurface.min() >= 0.0
    np.testing.assert_allclose(sum(found.components(WHITE)), split.transport @ WHITE, atol=1e-6)
