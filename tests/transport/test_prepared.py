"""Prepared transports make the same pictures, by any library."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import fetch
from nearfar.devices import mover
from nearfar.errors import InputError
from nearfar.transport.half import in_half
from nearfar.transport.prepared import prepare_transport
from tests.absent import PYTORCH_DEVICES
from tests.transport.test_operators import CAMERA, PROJECTOR, _transport

DEVICES = ["cpu", *PYTORCH_DEVICES]


@pytest.fixture
def generator():
    return np.random.default_rng(3)


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("channels", [1, 2])
@pytest.mark.parametrize("window", [4, 5])
def test_pictures_are_those_of_the_transport(generator, device, channels, window):
    transport = _transport(generator, window=window, channels=channels)
    prepared = prepare_transport(transport, device)
    for shape in ((3, *PROJECTOR), (3, *PROJECTOR, channels)):
        lights = generator.random(shape, dtype=np.float32)
        expected = transport.pictures(lights)
        for given in (lights, mover(device)(lights)):
            found = fetch(prepared.pictures(given))
            assert found.dtype == np.float32
            np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-5)
        np.testing.assert_allclose(prepared @ lights[0], transport @ lights[0], atol=1e-5)


@pytest.mark.parametrize("device", DEVICES)
def test_gains_scale_the_components(generator, device):
    transport = _transport(generator)
    light = generator.random(PROJECTOR, dtype=np.float32)
    gains = {"direct": 0.5, "near": 3.0, "far": -1.0}
    found = fetch(prepare_transport(transport, device).pictures(light[None], **gains))[0]
    np.testing.assert_allclose(found, transport.relight(light, **gains), rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("device", DEVICES)
def test_half_precision_takes_fewer_bytes_and_rounds_alone(generator, device):
    transport = _transport(generator)
    whole, half = (prepare_transport(transport, device, half=half) for half in (False, True))
    rounded = 2 * (transport.near.size + transport.far.size)
    assert whole.nbytes - half.nbytes == rounded
    light = generator.random(PROJECTOR, dtype=np.float32)
    np.testing.assert_allclose(half @ light, in_half(transport) @ light, rtol=1e-4, atol=1e-5)
    assert np.abs(half @ light - transport @ light).max() > 1e-5


def test_what_has_no_noise_is_not_rounded(generator, monkeypatch):
    # As on an accelerator, by the library's own arrays on the processor.
    monkeypatch.setattr("nearfar.transport.prepared.mover", lambda _device: np.asarray)
    transport = _transport(generator)
    assert prepare_transport(transport, "cuda").near.dtype == np.float32
    noisy = replace(transport, noise=np.full_like(transport.noise, 0.01))
    assert prepare_transport(noisy, "cuda").near.dtype == np.float16
    assert prepare_transport(noisy, "cpu").near.dtype == np.float32


def test_lights_of_another_size_are_refused(generator):
    prepared = prepare_transport(_transport(generator))
    for shape in ((1, 13, 17), (1, *PROJECTOR, 3), PROJECTOR):
        with pytest.raises(InputError, match="13x18"):
            prepared.pictures(np.ones(shape, dtype=np.float32))
    assert prepared.pictures(np.ones((0, *PROJECTOR), np.float32)).shape == (0, *CAMERA, 2)
