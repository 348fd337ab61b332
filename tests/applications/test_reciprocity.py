"""Far-range light by reciprocity, beside F of diffuse surfaces whose texture rows do not have."""

from dataclasses import replace

import numpy as np
import pytest

import nearfar
from nearfar.applications.dual import dual_view_of_stored
from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.illumination.frequencies import DC, far_frequencies, representatives
from nearfar.illumination.real_basis import real_basis
from nearfar.transport.store import save_transport
from nearfar.transport.stored import open_transport
from tests.applications.test_probe import blurred_world, world
from tests.worlds import model_transport

PROJECTOR, CAMERA = Size(24, 20), Size(36, 34)
CHANNELS = 2


def across(size):
    return np.meshgrid(*((np.arange(side) + 0.5) / side - 0.5 for side in size), indexing="ij")


def dimmed(size, strength, y0):
    y, x = across(size)
    return np.exp(-strength * ((y - y0) ** 2 + x**2))


def diffuse(*, lenses=0.0, one_way=0.0, waves=7):
    """Return a measured transport of textured surfaces, and its true F, (C, channels, P).

    A mirrored camera, finer than the projector; lenses that dim the corners of both; light that
    goes one way only.
    """
    draw = np.random.default_rng(0)
    texture = draw.uniform(0.2, 1.0, (CHANNELS, PROJECTOR.pixels))
    y, x = np.indices(PROJECTOR).reshape(2, -1)
    cy, cx = np.indices(CAMERA).reshape(2, -1)
    seen = (cy * PROJECTOR.height // CAMERA.height, cx * PROJECTOR.width // CAMERA.width)
    seen = (seen[0], PROJECTOR.width - 1 - seen[1])
    flat = seen[0] * PROJECTOR.width + seen[1]
    apart = (seen[0][:, None] - y) ** 2 + (seen[1][:, None] - x) ** 2
    between = 0.3 + np.exp(-apart / 100.0) + one_way * np.sin((y - 2 * seen[0][:, None]) / 4)
    true = texture[:, flat, None] * between * texture[:, None] / PROJECTOR.pixels
    true *= dimmed(CAMERA, lenses, 0.2).reshape(-1, 1) * dimmed(PROJECTOR, lenses, -0.1).ravel()
    true = np.moveaxis(true, 0, 1)
    band = representatives(far_frequencies(Size(waves, waves), PROJECTOR))
    basis = real_basis(band, PROJECTOR)
    base = model_transport(PROJECTOR, CAMERA, window=3, far=Size(3, 3), channels=CHANNELS)
    transport = replace(
        base,
        correspondence=np.stack(seen, axis=-1).reshape(*CAMERA, 2).astype(np.float32),
        far=(true @ basis.patterns.T).reshape(*CAMERA, CHANNELS, -1).astype(np.float32),
        far_basis=basis,
        near=np.zeros_like(base.near),
    )
    return transport, true


def decibels(found, expected):
    return 10 * np.log10(np.sum(expected**2) / np.sum((found - expected) ** 2))


def far_views(transport, true, reciprocity):
    """Return far-range light of a dual view by reciprocity, as measured, and the true one."""
    picture = np.random.default_rng(1).uniform(0, 1, (*CAMERA, CHANNELS)).astype(np.float32)
    picture[:, : CAMERA.width // 2] = 0
    expected = np.einsum("cip,ci->pi", true, picture.reshape(-1, CHANNELS))
    only = transport.with_gains(direct=0, near=0)
    without = nearfar.dual_view(only, picture)
    by = nearfar.dual_view(transport, picture, reciprocity=reciprocity)
    by = by - nearfar.dual_view(transport, picture) + without
    return by, without, expected.reshape(*PROJECTOR, CHANNELS)


@pytest.mark.parametrize("lenses", [0.0, 1.5])
def test_texture_that_rows_do_not_have_is_seen_by_the_camera(lenses):
    transport, true = diffuse(lenses=lenses)
    found = nearfar.find_reciprocity(transport)
    assert found.holds
    by, without, expected = far_views(transport, true, found)
    assert decibels(without, expected) < 14
    assert decibels(by, expected) > 27


def test_the_ratio_is_that_of_both_lenses():
    transport, _ = diffuse(lenses=1.5)
    found = nearfar.find_reciprocity(transport)
    expected = dimmed(PROJECTOR, 1.5, -0.1) / dimmed(PROJECTOR, 1.5, 0.2)
    ratio = found.ratio / found.ratio.mean() * expected.mean()
    # It varies by a factor of 2.4; both sides are blurred before they are compared.
    np.testing.assert_allclose(ratio, expected, rtol=0.15)
    same, _ = diffuse()
    np.testing.assert_allclose(nearfar.find_reciprocity(same).ratio, 1.0, atol=0.1)


def test_where_light_goes_one_way_the_transpose_stays():
    transport, _ = diffuse(one_way=0.6)
    found = nearfar.find_reciprocity(transport)
    assert found.disagreement > 0.2
    assert not found.holds
    np.testing.assert_array_equal(
        nearfar.dual_view(transport, reciprocity=found), nearfar.dual_view(transport)
    )


def test_nothing_is_added_to_what_is_measured_whole():
    transport, _ = diffuse()
    every = real_basis(representatives(far_frequencies(PROJECTOR, PROJECTOR)), PROJECTOR)
    assert every.count == PROJECTOR.pixels
    whole = replace(
        transport, far_basis=every, far=np.ones((*CAMERA, CHANNELS, every.count), np.float32)
    )
    assert nearfar.find_reciprocity(whole).complete
    assert not nearfar.find_reciprocity(whole).holds


@pytest.mark.parametrize("missing", ["direct light", "far-range light"])
def test_without_one_of_the_two_there_is_no_reciprocity(missing):
    transport, _ = diffuse()
    if missing == "direct light":
        nowhere = np.full_like(transport.correspondence, np.nan)
        transport = replace(transport, correspondence=nowhere)
    else:
        transport = replace(transport, far=np.zeros_like(transport.far))
    found = nearfar.find_reciprocity(transport)
    assert not found.holds
    assert found.disagreement == np.inf


def test_projector_pixels_that_the_camera_does_not_see_keep_the_transpose():
    transport, true = diffuse()
    q = transport.correspondence.copy()
    q[q[..., 0] > 15] = np.nan
    direct = np.where(np.isnan(q[..., :1]), 0, transport.direct)
    partly = replace(transport, correspondence=q, direct=direct.astype(np.float32))
    found = nearfar.find_reciprocity(partly)
    assert found.holds
    by, without, expected = far_views(partly, true, found)
    np.testing.assert_allclose(by[18:], without[18:], atol=1e-4)
    assert np.isfinite(by).all()
    assert decibels(by[:15], expected[:15]) > decibels(without[:15], expected[:15])


def test_gaps_between_camera_pixels_are_filled():
    """A camera whose pixels see every second projector pixel alone."""
    transport, _ = diffuse()
    q = np.indices(CAMERA).transpose(1, 2, 0) % (np.array(PROJECTOR) // 2) * 2
    coarse = replace(transport, correspondence=q.astype(np.float32))
    given = nearfar.Reciprocity(PROJECTOR, np.array([1.5, 0, 0, 0, 0]), 0.0, complete=False)
    (dc,) = coarse.far_basis.response_indices([DC])
    far_of_dc = np.zeros_like(coarse.far)
    far_of_dc[..., dc] = 1
    even = replace(coarse, far=far_of_dc)
    picture = np.ones((*CAMERA, CHANNELS), np.float32)
    view = nearfar.dual_view(even.with_gains(direct=0), picture, reciprocity=given)
    # F^T has no ratio.
    without = view / given.ratio[..., None]
    assert np.ptp(without) < 1e-3 * without.max()


@pytest.mark.parametrize("make", [world, blurred_world], ids=["single pixels", "hats"])
def test_near_range_light_away_from_q_is_what_the_camera_sees(make):
    transport = make()
    transport = replace(transport, far=np.zeros_like(transport.far))
    next_to_q = transport.near_basis.is_next_to_q.reshape(transport.near_basis.shape)
    away = replace(transport, near=np.where(next_to_q, np.float32(0), transport.near))
    camera, projector = transport.camera, transport.projector
    each = np.eye(camera.pixels)
    spread = np.stack([transport.factors.spread_directly(one).ravel() for one in each], axis=1)
    count = spread.sum(axis=1)
    picture = np.random.default_rng(3).uniform(0, 1, camera).astype(np.float32)
    _, near, _ = away.component_rows(slice(None))
    seen = np.einsum("cip,p->ci", near, spread @ picture.ravel())
    given = nearfar.Reciprocity(projector, np.zeros(5), 0.0, complete=False)
    change = nearfar.dual_view(transport, picture, reciprocity=given)
    change = (change - nearfar.dual_view(transport, picture)).reshape(-1, 2)
    surely = count > 0.2 * np.median(count[count > 0])
    assert surely.sum() > 50
    by = (spread @ seen)[surely] / count[surely, None]
    transposed = np.einsum("cip,c->pi", near, picture.ravel())[surely]
    np.testing.assert_allclose(change[surely], by - transposed, atol=2e-5)
    assert np.abs(by - transposed).max() > 1e-3


def test_what_an_error_of_q_takes_from_direct_light_is_not_lost():
    """T is the identity, in a window that makes up for errors of q."""
    size = Size(16, 16)
    places = np.moveaxis(np.indices(size), 0, -1)
    off = np.random.default_rng(5).uniform(-0.2, 0.2, (*size, 2))
    # At the border q is right: beyond it there is nothing.
    inside = (places.min(axis=-1) > 1) & (places.max(axis=-1) < 14)
    q = places + np.where(inside[..., None], off, 0.0)
    base = model_transport(size, size, window=5, far=Size(3, 3))
    nothing = replace(
        base,
        correspondence=q.astype(np.float32),
        direct=np.ones_like(base.direct),
        near=np.zeros_like(base.near),
        far=np.zeros_like(base.far),
    )
    direct, _, _ = nothing.component_rows(slice(None))
    near = np.zeros_like(base.near)
    for number, row in enumerate(direct[:, 0]):
        y, x = divmod(number, size.width)
        missing = ((np.arange(size.pixels) == number) - row).reshape(size)
        near[y, x] = np.pad(missing, 2)[y : y + 5, x : x + 5]
    transport = replace(nothing, near=near)
    picture = np.random.default_rng(6).uniform(0, 1, size).astype(np.float32)
    np.testing.assert_allclose(transport @ picture, picture, atol=1e-5)
    given = nearfar.Reciprocity(size, np.zeros(5), 0.0, complete=False)
    np.testing.assert_allclose(
        nearfar.dual_view(transport, picture, reciprocity=given), picture, atol=1e-5
    )


@pytest.mark.parametrize("make", [world, blurred_world], ids=["single pixels", "boxes"])
def test_what_is_sent_back_directly_is_the_adjoint_of_direct_light(make):
    transport = make(channels=1) if make is world else make()
    factors, draw = transport.factors, np.random.default_rng(2)
    image = draw.uniform(0, 1, transport.camera.pixels)
    light = draw.uniform(0, 1, transport.projector).astype(np.float32)
    ones = np.where(transport.lit[..., None], np.ones_like(transport.direct), 0)
    looked = replace(transport, direct=ones).components(light).direct
    seen = np.reshape(looked, (transport.camera.pixels, -1))[:, 0]
    assert np.vdot(image, seen) == pytest.approx(
        np.vdot(factors.spread_directly(image), light), rel=1e-5
    )


def test_a_stored_transport_gives_the_same_with_gains(tmp_path, monkeypatch):
    transport, _ = diffuse()
    save_transport(transport, tmp_path / "t.zarr")
    stored = open_transport(tmp_path / "t.zarr")
    monkeypatch.setattr("nearfar.transport.stored.READ_BYTES", stored._row_bytes * 5)
    blocks = type(stored).blocks
    monkeypatch.setattr(type(stored), "blocks", lambda self: blocks(self, 5 * self._row_bytes))
    assert len(list(stored.blocks())) == 8
    here, there = (nearfar.find_reciprocity(each) for each in (transport, stored))
    np.testing.assert_allclose(there.coefficients, here.coefficients, rtol=1e-5)
    assert there.disagreement == pytest.approx(here.disagreement)
    expected = nearfar.dual_view(transport.with_gains(far=2, near=3, direct=0.5), reciprocity=here)
    view = dual_view_of_stored(
        stored, None, {"far": 2.0, "near": 3.0, "direct": 0.5}, reciprocity=there
    )
    np.testing.assert_allclose(view, expected, rtol=1e-4, atol=1e-6)
    off = dual_view_of_stored(stored, None, {"far": 0.0}, reciprocity=there)
    np.testing.assert_array_equal(off, dual_view_of_stored(stored, None, {"far": 0.0}))


def test_a_known_transport_needs_no_reciprocity():
    transport, _ = diffuse()
    known = nearfar.ExactTransport((2, 2), (2, 2), (), (), np.ones((1, 4, 4), np.float32))
    with pytest.raises(InputError, match="leave reciprocity out"):
        nearfar.dual_view(known, reciprocity=nearfar.find_reciprocity(transport))
