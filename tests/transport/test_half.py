"""Windows and bands in float16: half the bytes, and no more error than is told."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.transport.half import in_half, rounding_over_noise
from nearfar.transport.store import load_transport, save_transport
from tests.transport.test_operators import CAMERA, PROJECTOR, _transport


@pytest.fixture
def transport():
    plain = _transport(np.random.default_rng(3))
    return replace(plain, noise=np.full_like(plain.noise, 0.01))


def test_what_is_computed_of_it_is_single_or_better(transport):
    half, generator = in_half(transport), np.random.default_rng(0)
    assert half.near.dtype == half.far.dtype == np.float16
    light = generator.random(PROJECTOR, dtype=np.float32)
    picture = half @ light
    assert picture.dtype == np.float32
    np.testing.assert_allclose(picture, half.pictures(light[None])[0], rtol=1e-5, atol=1e-5)
    # The same as of the rounded factors in single precision, to rounding of single precision.
    rounded = replace(half, near=half.near.astype(np.float32), far=half.far.astype(np.float32))
    np.testing.assert_allclose(picture, rounded @ light, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(half.dense(), rounded.dense(), rtol=1e-6, atol=1e-7)
    image = generator.random((*CAMERA, 2))
    there, back = np.vdot(picture, image), np.vdot(light, half.adjoint(image).sum(axis=-1))
    assert there == pytest.approx(back, rel=1e-4)


def test_rounding_is_told_beside_the_noise(transport):
    told = rounding_over_noise(transport)
    off = in_half(transport)
    entry = np.sqrt(np.mean((off.near - transport.near.astype(np.float64)) ** 2))
    answer = np.sqrt(np.mean((off.far - transport.far.astype(np.float64)) ** 2))
    of_entries = entry / (0.01 * np.sqrt(2) / transport.window)
    assert told == pytest.approx(max(of_entries, answer / 0.01), rel=1e-4)
    assert 0 < told < 0.1
    louder = replace(transport, noise=10 * transport.noise)
    assert rounding_over_noise(louder) == pytest.approx(told / 10)
    assert rounding_over_noise(replace(transport, noise=0 * transport.noise)) == np.inf
    assert rounding_over_noise(in_half(transport)) == 0


def test_it_is_stored_as_it_is(tmp_path, transport):
    save_transport(in_half(transport), tmp_path / "half.zarr")
    loaded = load_transport(tmp_path / "half.zarr")
    for name in ("near", "far"):
        assert getattr(loaded, name).dtype == np.float16
        np.testing.assert_array_equal(getattr(loaded, name), getattr(in_half(transport), name))
    assert loaded.direct.dtype == np.float32
