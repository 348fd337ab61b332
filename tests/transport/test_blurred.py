"""Transports whose near-range light is made of hats of several projector pixels."""

from dataclasses import replace

import numpy as np
import pytest

import nearfar
from nearfar.arrays import Size
from nearfar.errors import UnreadableFileError
from nearfar.files.stores import open_durable_store
from nearfar.illumination.frequencies import DC, far_frequencies, representatives
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import real_basis
from nearfar.transport import near as windows
from nearfar.transport.model import Transport
from nearfar.transport.pyramid import Pyramid
from nearfar.transport.rows import of_pixels, of_rows, stacked
from nearfar.transport.stored import StoredTransport, open_transport
from nearfar.workflow.relight import relight_stored

PROJECTOR, CAMERA = Size(37, 52), Size(5, 7)
BASIS = NearBasis(5, 4)


@pytest.fixture(params=[1, 3], ids=["grey", "colour"])
def transport(request):
    """Return factors drawn at random, q up to the very border, two camera pixels without any."""
    draw, channels = np.random.default_rng(8), request.param
    q = draw.random((*CAMERA, 2)) * (np.array(PROJECTOR) - 1)
    q[0, 0], q[4, 6], q[2, 3] = (0.0, 0.0), np.array(PROJECTOR) - 1, (0.3, 50.8)
    dark = np.zeros(CAMERA, dtype=bool)
    dark[1, 1:3] = True
    q[dark] = np.nan
    far = real_basis([DC, *representatives(far_frequencies(Size(3, 5), PROJECTOR))[1:]], PROJECTOR)
    shape = (*CAMERA, channels)
    lit = ~dark[..., None]
    return Transport(
        projector=PROJECTOR,
        correspondence=q.astype(np.float32),
        direct=(draw.random(shape) * lit).astype(np.float32),
        near=(0.1 * draw.normal(size=(*shape, BASIS.count)) * lit[..., None]).astype(np.float32),
        far=draw.normal(size=(*shape, far.count)).astype(np.float32),
        far_basis=far,
        black=np.zeros(shape, dtype=np.float32),
        noise=np.full(shape, 1e-3, dtype=np.float32),
        pitch=BASIS.pitch,
        footprint=(draw.random((*CAMERA, 4)) * [5.0, 5.0, 2.0, 3.0]).astype(np.float32),
    )


def _box(q, sides):
    """Shares of a box that projector pixels cover, flat; none of what lies beyond the border."""
    of_axes = []
    for middle, side, pixels in zip(q, sides, PROJECTOR, strict=True):
        ends = np.clip(np.arange(pixels + 1) - 0.5, middle - side / 2, middle + side / 2)
        of_axes.append(np.diff(ends) / side)
    return np.outer(*of_axes).ravel()


def _by_hand(transport, light):
    """Relight by summing each function over the projector pixels that it covers."""
    light = light.reshape(*PROJECTOR, -1)
    q = transport.correspondence.reshape(-1, 2)
    centres = windows.centre(q, PROJECTOR)
    places = np.stack(np.meshgrid(*map(np.arange, PROJECTOR), indexing="ij"), axis=-1)
    flat = places.reshape(-1, 2)
    picture = np.zeros((CAMERA.pixels, transport.channels))
    for c in range(CAMERA.pixels):
        row = transport.near.reshape(CAMERA.pixels, transport.channels, -1)[c] @ (
            BASIS.values_at(flat - centres[c]).T
        )
        if np.isfinite(q[c]).all():
            *sides, down, across = transport.footprint.reshape(-1, 4)[c].astype(np.float64)
            middles = [
                q[c].astype(np.float64) + sign * np.array([down, across]) for sign in (1, -1)
            ]
            shares = np.mean([_box(middle, sides) for middle in middles], axis=0)
            row += transport.direct.reshape(-1, transport.channels)[c, :, None] * shares
        for i in range(transport.channels):
            picture[c, i] = row[i] @ light[..., min(i, light.shape[-1] - 1)].ravel()
    far = replace(transport, direct=0 * transport.direct, near=0 * transport.near)
    squeezed = light[..., 0] if light.shape[-1] == 1 else light
    return transport.picture(picture) + far @ squeezed


def test_a_light_is_summed_over_what_lies_on_the_projector(transport):
    light = np.random.default_rng(1).random(PROJECTOR)
    np.testing.assert_allclose(transport @ light, _by_hand(transport, light), atol=1e-6)


def test_coloured_light_goes_channel_by_channel(transport):
    light = np.random.default_rng(1).random((*PROJECTOR, transport.channels))
    np.testing.assert_allclose(transport @ light, _by_hand(transport, light), atol=1e-6)


def test_several_lights_are_relit_as_one_by_one(transport):
    lights = np.random.default_rng(2).random((11, *PROJECTOR)).astype(np.float32)
    coloured = np.repeat(lights[..., None], transport.channels, axis=-1)
    for several in (lights, coloured):
        pictures = transport.pictures(several)
        for light, picture in zip(several, pictures, strict=True):
            relit = (transport @ light).reshape(picture.shape)
            np.testing.assert_allclose(picture, relit, atol=2e-6)


@pytest.mark.parametrize("place", [(0, 0), (36, 51), (18, 20), (36, 7)])
def test_a_light_that_few_camera_pixels_see_is_relit_as_any_other(transport, place):
    light = np.zeros(PROJECTOR)
    light[place] = 0.7
    np.testing.assert_allclose(transport @ light, _by_hand(transport, light), atol=1e-6)
    assert not np.any(transport @ np.zeros(PROJECTOR))


def test_functions_are_drawn_as_their_values_say():
    draw = np.random.default_rng(9)
    for basis in (BASIS, NearBasis(3, 2), NearBasis(11, 16), NearBasis(4, 8)):
        coefficients = draw.normal(size=(2, basis.count))
        side = np.arange(-basis.reach, basis.reach + 1)
        offsets = np.stack(np.meshgrid(side, side, indexing="ij"), axis=-1).reshape(-1, 2)
        expected = coefficients @ basis.values_at(offsets).T
        drawn = basis.drawn(coefficients).reshape(2, -1)
        np.testing.assert_allclose(drawn, expected, atol=1e-12)


def test_the_adjoint_is_one(transport):
    draw = np.random.default_rng(3)
    light = draw.random((*PROJECTOR, transport.channels))
    image = draw.random((*CAMERA, transport.channels))
    if transport.channels == 1:
        light, image = light[..., 0], image[..., 0]
    assert np.vdot(transport @ light, image) == pytest.approx(
        np.vdot(light, transport.adjoint(image)), rel=1e-6
    )


def test_rows_columns_and_operators_are_the_same_transport(transport):
    light = np.random.default_rng(4).random(PROJECTOR)
    relit = (transport @ light).reshape(CAMERA.pixels, -1)
    rows = transport.rows(slice(3, 12))
    np.testing.assert_allclose(rows @ light.ravel(), relit[3:12], atol=1e-6)
    np.testing.assert_allclose(
        transport.column(0, 51).reshape(CAMERA.pixels, -1)[3:12], rows[..., 51], atol=1e-6
    )
    np.testing.assert_allclose(
        transport.as_linear_operator(0) @ light.ravel(), relit[:, 0], atol=1e-6
    )
    prepared = nearfar.prepare_transport(transport)
    np.testing.assert_allclose((prepared @ light).reshape(relit.shape), relit, atol=1e-5)
    coloured = np.repeat(light[..., None], transport.channels, axis=-1)
    pictures = prepared.pictures(coloured[None].astype(np.float32))
    np.testing.assert_allclose(pictures[0].reshape(relit.shape), relit, atol=1e-5)


def test_camera_rows_are_taken_apart_and_joined(transport):
    light = np.random.default_rng(5).random(PROJECTOR)
    joined = stacked([of_rows(transport, slice(0, 2)), of_rows(transport, slice(2, None))])
    np.testing.assert_array_equal(joined @ light, transport @ light)
    some = of_pixels(transport, np.array([1, 4]), np.array([0, 5, 6]))
    np.testing.assert_array_equal(some @ light, (transport @ light)[[1, 4]][:, [0, 5, 6]])


def test_it_is_stored_and_read_in_blocks(transport, tmp_path):
    path = tmp_path / "transport.zarr"
    nearfar.save_transport(transport, path)
    light = np.random.default_rng(6).random(PROJECTOR)
    read = nearfar.load_transport(path)
    assert read.pitch == BASIS.pitch
    np.testing.assert_array_equal(read @ light, transport @ light)


@pytest.mark.parametrize("pitch", [0, 3, 2, -4, "4", 2.0, 2**30])
def test_a_pitch_that_does_not_fit_gets_a_sentence(transport, tmp_path, pitch):
    path = tmp_path / "transport.zarr"
    nearfar.save_transport(transport, path)
    open_durable_store(path).attrs["pitch"] = pitch
    with pytest.raises(UnreadableFileError, match="reconstruct it again"):
        nearfar.load_transport(path)


def test_a_light_is_analysed_once_for_all_blocks_of_camera_rows(transport, tmp_path, monkeypatch):
    colours = transport.channels
    light = np.random.default_rng(3).random((*PROJECTOR, colours), dtype=np.float32)
    analysed = transport.analyse(light)
    blocks = [of_rows(transport, slice(first, first + 2)) for first in (0, 2, 4)]
    for whole, parts in zip(
        transport.components(light),
        zip(*(block.components(analysed) for block in blocks), strict=True),
        strict=True,
    ):
        np.testing.assert_array_equal(whole, np.concatenate(parts))
    nearfar.save_transport(transport, tmp_path / "stored.zarr")
    stored = open_transport(tmp_path / "stored.zarr")
    # A row at a time.
    monkeypatch.setattr(StoredTransport.blocks, "__defaults__", (1,))
    blurred = []
    levels = Pyramid.levels
    monkeypatch.setattr(Pyramid, "levels", lambda *given: blurred.append(None) or levels(*given))
    by_rows = relight_stored(stored, light, {"near": 2.0})
    assert len(blurred) == colours
    np.testing.assert_allclose(by_rows, transport.relight(light, near=2.0), rtol=1e-5, atol=1e-5)
