"""The physical split of a Cornell box with a candle, against the scene's own components."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from nearfar import ErrorBars, Size, choose_plan, natural_picture, snr
from nearfar.correspondence import correspond_by_phase
from nearfar.errors import InputError
from nearfar.estimate.joint import estimate_jointly
from nearfar.estimate.physical import PhysicalErrorBars, split_physically
from nearfar.estimate.physical.split import on_bodies
from nearfar.photometry.measure import measure
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.cache import cached_scene
from nearfar.transport.quality import Quality
from nearfar.workflow.acquire import acquire_in_memory

PHOTOS = 117
# In dB of direct light, subsurface light and inter-reflection, floodlit.
WANTED = (32.0, 21.0, 21.0)
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def scene():
    return cached_scene("cornell")


@pytest.fixture(scope="module")
def split(scene):
    plan, _ = choose_plan(scene.projector, PHOTOS, window=11)
    rig = SimulatedRig(scene, "cornell", SimulatedProjector(), SimulatedCamera(), 1.0, 0)
    measurements = measure(acquire_in_memory(plan, rig))
    q = correspond_by_phase(measurements, pitch=plan.pitch).q
    found = estimate_jointly(measurements, q, plan.window, plan.far, pitch=plan.pitch)
    return split_physically(found)


def test_floodlit_components_are_those_of_the_scene(scene, split):
    white = np.ones(scene.projector, np.float32)
    truth, found = scene.component_pictures(white), split.components(white)
    for wanted, true, part in zip(WANTED, truth, found, strict=True):
        assert snr(true, part) > wanted
    np.testing.assert_allclose(sum(found), split.transport @ white, atol=1e-5)
    candle = truth[1].any(axis=-1) & split.transport.lit
    ratio = found.direct[candle].std(axis=0) / truth[0][candle].std(axis=0)
    assert np.all((ratio > 1 / 1.3) & (ratio < 1.3))


def shot(name, projector, camera, photos):
    """Return the floodlit components of a scene, and its split from photos of it."""
    scene = cached_scene(name, projector, camera)
    plan, _ = choose_plan(scene.projector, photos)
    rig = SimulatedRig(scene, name, SimulatedProjector(), SimulatedCamera(), 1.0, 0)
    measurements = measure(acquire_in_memory(plan, rig))
    q = correspond_by_phase(measurements, pitch=plan.pitch).q
    found = estimate_jointly(measurements, q, plan.window, plan.far, pitch=plan.pitch)
    white = np.ones(scene.projector, np.float32)
    return scene.component_pictures(white), split_physically(found)


def floodlit(name, projector, camera, photos):
    """Return the floodlit components of a scene, and those that are found from photos of it."""
    truth, split = shot(name, projector, camera, photos)
    return truth, split.components(np.ones(projector, np.float32))


def decibels(truth, found):
    """Return the SNR of each component."""
    return np.array([snr(true, part) for true, part in zip(truth, found, strict=True)])


def roughness(parts, within):
    """Return by how much inter-reflection's share of light differs from that of 3x3 pixels."""
    share = parts[2] / sum(parts)
    return np.std((share - ndimage.uniform_filter(share, (3, 3, 1)))[within])


def test_a_channel_that_seems_hardly_to_fade_is_told_by_the_others():
    """By few photos red light of the candle has no end where responses tell anything."""
    found = decibels(*floodlit("cornell", Size(48, 40), Size(64, 80), 90))
    # Without it: no subsurface light at all, and 26 dB of direct light.
    assert np.all(found > (31.0, 18.0, 20.0))


def test_inter_reflection_of_bodies_is_smooth():
    """Each camera pixel of marble alone takes some of it for subsurface light."""
    truth, found = floodlit("marble", Size(32, 32), Size(48, 48), 60)
    marble = ndimage.binary_erosion(truth[1].any(axis=-1), np.ones((3, 3)))
    # If it is not smoothed, it is 1.4 times as rough as the scene's.
    assert roughness(found, marble) < roughness(truth, marble)
    # Where sources may be as shallow as any: 14.1 dB of subsurface light.
    assert np.all(decibels(truth, found) > (24.5, 14.6, 6.2))


def test_outlines_of_a_hand_are_mixtures():
    """Between fingers and at their tips camera pixels see the hand and a wall."""
    found = decibels(*floodlit("hand", Size(32, 32), Size(48, 48), 60))
    # Without what second places tell: 19.8 dB of direct light. Where sources may be as shallow as
    # any: 13.5 dB of subsurface light.
    assert np.all(found > (20.1, 14.0, 8.7))


def test_error_bars_of_components_hold_as_often_as_they_should(scene, split):
    candle = np.zeros(split.transport.camera.pixels, bool)
    for body in split.bodies:
        candle[body.pixels] = True
    opaque = split.transport.lit & ~candle.reshape(split.transport.camera)
    for light in (np.ones(scene.projector, np.float32), natural_picture(scene.projector, 3)):
        truth, found = scene.component_pictures(light), split.components(light)
        bars = PhysicalErrorBars(split).components(light)
        for part in ("direct", "subsurface", "interreflection"):
            i = found._fields.index(part)
            within = np.abs(found[i] - truth[i]) < bars[i]
            assert 0.45 < within[candle.reshape(opaque.shape)].mean() < 0.9, part
            if part == "subsurface":
                assert not bars[i][opaque].any()
            else:
                assert 0.6 < within[opaque].mean() < 0.8, part


def test_where_sources_are_shallow_error_bars_are_wide():
    """Photos of a coarse projector tell light next to q from direct light worse than a fine one."""
    size, white = Size(32, 32), np.ones((32, 32), np.float32)
    truth, split = shot("cornell", size, size, 33)
    candle = on_bodies(split) & truth[1].any(axis=-1)
    found, bars = split.components(white), PhysicalErrorBars(split).components(white)
    within = [
        np.mean((np.abs(f - t) < b)[candle]) for f, t, b in zip(found, truth, bars, strict=True)
    ]
    # If they did not follow depth: 61 % of direct light and 49 % of subsurface light.
    assert 0.66 < within[0] < 0.85
    assert 0.6 < within[1] < 0.85


def test_at_outlines_direct_and_subsurface_light_have_what_the_other_lacks(scene, split):
    """Their sum, and inter-reflection, are as sure as elsewhere."""
    white = np.ones(scene.projector, np.float32)
    candle = np.zeros(split.transport.camera.pixels, bool)
    for body in split.bodies:
        candle[body.pixels] = True
    candle = candle.reshape(split.transport.camera)
    outline = candle & ~ndimage.binary_erosion(candle, np.ones((3, 3)))
    bars, found = PhysicalErrorBars(split), split.components(white)
    direct, subsurface, interreflection = bars.components(white)
    assert np.all(direct[outline] >= 0.0999 * np.abs(found.direct[outline]))
    assert np.all(subsurface[outline] >= 0.0999 * np.abs(found.direct[outline]))
    assert np.median((interreflection / direct)[outline]) < 1.5
    both = bars.picture(white, interreflection=0.0)
    assert np.all(both[outline] < np.hypot(direct, subsurface)[outline])
    assert np.mean((both < direct)[outline]) > 0.05
    # All inside is lit; there, direct light is no surer than half of what the estimate says of it.
    inner = candle & ~outline
    own = ErrorBars(split.transport).direct()[inner]
    assert np.mean(direct[inner] > 0.49 * own) > 0.95


def test_bars_grow_with_the_light(scene, split):
    light = natural_picture(scene.projector, 3)
    once, twice = (PhysicalErrorBars(split).components(factor * light) for factor in (0.25, 0.5))
    for one, two in zip(once[:2], twice[:2], strict=True):
        np.testing.assert_allclose(two, 2 * one, rtol=1e-4, atol=1e-9)


def test_bars_of_a_picture_are_those_of_its_components(scene, split):
    light = natural_picture(scene.projector, 3)
    bars = PhysicalErrorBars(split)
    whole = ErrorBars(split.transport).picture(light)
    np.testing.assert_allclose(bars.picture(light), whole, rtol=1e-5)
    alone = {"direct": 0.0, "subsurface": 0.0, "interreflection": 0.0}
    for name, part in bars.components(light)._asdict().items():
        found = bars.picture(light, **(alone | {name: 2.0}))
        np.testing.assert_allclose(found, 2 * part, rtol=1e-5, atol=1e-9)


def test_of_saturated_camera_pixels_nothing_is_known(scene, split):
    transport = split.transport
    clear = np.zeros(transport.camera, dtype=bool)
    saturated = clear.copy()
    saturated[3, 5] = True
    quality = Quality(np.ones(transport.camera, np.float32), saturated)
    spoilt = replace(split, transport=replace(transport, quality=quality))
    found = PhysicalErrorBars(spoilt).picture(np.ones(scene.projector, np.float32), subsurface=0.0)
    assert np.isinf(found[3, 5]).all()
    assert np.isfinite(found[~saturated]).all()
    dark_there = np.zeros(scene.projector, np.float32)
    dark_there[-3:, -3:] = 1.0
    for part in PhysicalErrorBars(spoilt).components(dark_there):
        assert np.isinf(part[3, 5]).all()
        assert np.isfinite(part[~saturated]).all()


def test_a_transport_without_error_bars_says_so(split):
    without = replace(split, transport=replace(split.transport, posterior=None))
    with pytest.raises(InputError, match="holds no error bars"):
        PhysicalErrorBars(without)
