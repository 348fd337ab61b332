"""The dual view beside T's dense transpose."""

import numpy as np
import pytest

import nearfar
from nearfar.applications.dual import dual_view_of_stored
from nearfar.errors import InputError
from nearfar.transport.store import save_transport
from nearfar.transport.stored import open_transport
from tests.applications.test_probe import CAMERA, PROJECTOR, WORLDS, three_rows


def transposed(rows, picture):
    """Multiply dense rows (C, channels, P) with a picture from the other side."""
    lit = np.broadcast_to(picture.reshape(CAMERA.pixels, -1), (CAMERA.pixels, 2))
    return np.einsum("cip,ci->pi", rows, lit).reshape(*PROJECTOR, 2)


def a_picture(channels=None):
    shape = CAMERA if channels is None else (*CAMERA, channels)
    return np.random.default_rng(4).uniform(0, 1, shape).astype(np.float32)


@pytest.mark.parametrize("make", WORLDS.values(), ids=WORLDS)
@pytest.mark.parametrize("channels", [None, 2])
def test_the_dual_view_is_by_the_transpose(make, channels):
    transport, picture = make(), a_picture(channels)
    found = nearfar.dual_view(transport, picture)
    np.testing.assert_allclose(found, transposed(transport.dense(), picture), atol=1e-4)
    white = nearfar.dual_view(transport)
    np.testing.assert_allclose(white, transposed(transport.dense(), np.ones(CAMERA)), atol=1e-4)


def test_a_symmetric_scene_looks_the_same_from_both_sides():
    matrix = np.random.default_rng(2).uniform(0, 1, (1, 30, 30)).astype(np.float32)
    scene = nearfar.ExactTransport((5, 6), (5, 6), (), (), matrix + np.swapaxes(matrix, 1, 2))
    light = np.random.default_rng(3).uniform(0, 1, (5, 6))
    dual = nearfar.dual_view(scene, light)
    np.testing.assert_allclose(dual, (scene @ light)[..., 0], rtol=1e-5)


@pytest.mark.parametrize("make", WORLDS.values(), ids=WORLDS)
def test_a_stored_transport_gives_the_same_with_components_apart(make, tmp_path, monkeypatch):
    transport, picture = make(), a_picture()
    save_transport(transport, tmp_path / "t.zarr")
    monkeypatch.setattr("nearfar.transport.stored.StoredTransport.blocks", three_rows)
    stored = open_transport(tmp_path / "t.zarr")
    whole = dual_view_of_stored(stored, picture, {})
    np.testing.assert_allclose(whole, nearfar.dual_view(transport, picture), atol=1e-4)
    direct = dual_view_of_stored(stored, picture, {"near": 0.0, "far": 0.0})
    only = transport.component_rows(slice(None)).direct
    np.testing.assert_allclose(direct, transposed(only, picture), atol=1e-4)


def test_flat_fields_are_divided_out(tmp_path):
    """A transport behind two lenses that dim the corners, and the same without them."""
    plain = WORLDS["single pixels"]()
    of_camera, of_projector = (
        np.random.default_rng(i).uniform(0.3, 1.0, size).astype(np.float32)
        for i, size in enumerate((CAMERA, PROJECTOR))
    )
    matrices = np.moveaxis(plain.dense(), 1, 0)
    dimmed = matrices * of_camera.reshape(-1, 1) * of_projector.ravel()
    one, other = (nearfar.ExactTransport(PROJECTOR, CAMERA, (), (), m) for m in (matrices, dimmed))
    flats = {"camera_flat": 50 * of_camera, "projector_flat": 3 * of_projector}
    found = nearfar.dual_view(other, a_picture(), **flats)
    expected = nearfar.dual_view(one, a_picture()) * of_camera.mean() * of_projector.mean()
    np.testing.assert_allclose(found, expected, rtol=1e-4)
    save_transport(plain, tmp_path / "t.zarr")
    stored = open_transport(tmp_path / "t.zarr")
    np.testing.assert_allclose(
        dual_view_of_stored(stored, a_picture(), {}, **flats),
        nearfar.dual_view(plain, a_picture(), **flats),
        rtol=1e-4,
    )
    with pytest.raises(InputError, match="flat field of the camera is 3x3"):
        nearfar.dual_view(plain, camera_flat=np.ones((3, 3)))
    with pytest.raises(InputError, match="flat field of the projector has values of 0"):
        nearfar.dual_view(plain, projector_flat=np.zeros(PROJECTOR))


@pytest.mark.parametrize(
    ("picture", "words"),
    [
        (np.ones((3, 3)), "the picture is 3x3, this transport's camera is 9x11"),
        (np.ones((*CAMERA, 3)), "the picture has 3 channels"),
        (np.full(CAMERA, np.nan), "the picture holds NaN"),
    ],
)
def test_a_picture_that_does_not_fit_is_refused(picture, words):
    with pytest.raises(InputError, match=words):
        nearfar.dual_view(WORLDS["single pixels"](), picture)
