"""Lights that photos correct: on a simulated rig whose response the transport does not know."""

from dataclasses import replace

import numpy as np
import pytest

import nearfar
from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from tests.worlds import model_transport

PROJECTOR, CAMERA = Size(14, 16), Size(20, 22)


def world(channels=1):
    made = model_transport(
        PROJECTOR, CAMERA, window=5, far=Size(3, 3), channels=channels, fractional=True
    )
    brightest = float((made @ np.ones(PROJECTOR, np.float32)).max())
    return (0.8 / brightest) * made


def rig_of(transport, gamma=1.0, **camera):
    sensor = SimulatedCamera(**{"bits": 16, "full_well": 1e7, **camera})
    return SimulatedRig(transport, "world", SimulatedProjector(gamma=gamma), sensor, 1.0, seed=4)


def asked(transport):
    """A picture that some light makes, and the light for it."""
    drawn = nearfar.natural_picture(PROJECTOR, 3)
    light = np.stack([0.2 + 0.7 * np.roll(drawn, i, axis=1) for i in range(transport.channels)], -1)
    wanted = transport @ (light if transport.channels > 1 else light[..., 0])
    return nearfar.compensate(transport, wanted, 1.0)


def distance(transport, light, target, gamma):
    """Of the photo without noise, as the scene makes it."""
    truly = transport @ (np.rint(255 * light) / 255).astype(np.float32) ** np.float32(gamma)
    return float(np.sqrt(np.mean((truly - target) ** 2)))


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("gamma", [0.7, 2.2])
def test_photos_correct_what_the_transport_does_not_know(channels, gamma):
    transport = world(channels)
    found = asked(transport)
    refined = nearfar.refine_compensation(transport, found, rig_of(transport, gamma), 3)
    before, after = (
        distance(transport, light, found.target, gamma) for light in (found.light, refined.light)
    )
    assert after < 0.35 * before
    assert refined.rmse == min(refined.errors)
    assert refined.psnr > refined.psnr_before + 9
    np.testing.assert_array_equal(np.rint(255 * refined.light), 255 * refined.light)
    # What the photos say of the light that is kept is true, to their noise.
    assert refined.rmse == pytest.approx(after, rel=0.1)


def test_the_light_whose_photo_was_best_is_kept():
    """Photos that are nearly all noise: corrections make them worse."""
    transport = world()
    found = asked(transport)
    rig = rig_of(transport, full_well=60.0)
    refined = nearfar.refine_compensation(transport, found, rig, 3)
    assert refined.errors[0] == min(refined.errors) < max(refined.errors[1:])
    np.testing.assert_allclose(refined.light, found.light, atol=0.5 / 255 + 1e-6)


def test_ambient_light_is_taken_off():
    transport = world()
    found = asked(transport)
    photos = [
        nearfar.refine_compensation(transport, found, rig_of(transport, ambient=a), 1).photo
        for a in (0.0, 0.1)
    ]
    np.testing.assert_allclose(photos[0], photos[1], atol=0.01)
    assert np.abs(photos[0] - found.target).mean() < 0.01


def test_what_does_not_fit_gets_a_sentence():
    transport = world()
    found = asked(transport)
    small = model_transport(Size(4, 4), Size(5, 5), window=3, far=Size(1, 1))
    other = rig_of(small)
    with pytest.raises(InputError, match="the rig has 4x4"):
        nearfar.refine_compensation(transport, found, other)
    with pytest.raises(InputError, match="photos are 20x22x3"):
        nearfar.refine_compensation(transport, found, rig_of(world(3)))
    for compensation in (asked(world(3)), nearfar.compensate(small, np.ones((5, 5)), 1.0)):
        with pytest.raises(InputError, match="give the transport that it was computed with"):
            nearfar.refine_compensation(transport, compensation, rig_of(transport))
    for corrections in (0, 4):
        with pytest.raises(InputError, match="give 1 to 3"):
            nearfar.refine_compensation(transport, found, rig_of(transport), corrections)


def test_a_wanted_photo_has_the_light_under_black_in_it():
    transport = world()
    black = np.random.default_rng(2).uniform(0.02, 0.05, (*CAMERA, 1)).astype(np.float32)
    transport = replace(transport, black=black)
    light = 0.3 + 0.5 * nearfar.natural_picture(PROJECTOR, 3)
    photo = transport @ light + black[..., 0]
    found = nearfar.compensate(transport, photo, 1.0, black=transport.black)
    assert np.abs(transport @ found.light + black[..., 0] - photo).max() < 0.02 * photo.max()
    # A scale that is chosen makes the most of white, whatever the unit of the picture.
    free, again = (nearfar.compensate(transport, k * photo, black=black) for k in (1.0, 50.0))
    assert free.scale == pytest.approx(50 * again.scale, rel=1e-3)
    assert free.scale > 1.0
    assert free.light.max() > 0.95
