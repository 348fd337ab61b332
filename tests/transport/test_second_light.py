"""Direct light from second places, in every way to apply a transport."""

from dataclasses import replace

import numpy as np
import pytest

import nearfar
from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.report.contents import describe
from nearfar.transport.rows import of_rows, stacked
from nearfar.transport.store import load_transport, save_transport
from nearfar.transport.stored import open_transport
from tests.worlds import model_transport

PROJECTOR, CAMERA = Size(13, 18), Size(9, 7)


@pytest.fixture
def transport():
    """Some camera pixels see a second place, at a corner, a border, between pixels and on one."""
    base = model_transport(PROJECTOR, CAMERA, window=5, far=Size(3, 3), channels=2)
    places = np.full((*CAMERA, 2), np.nan, np.float32)
    places[0, 0], places[2, 3], places[2, 4] = (12, 17), (3.25, 0), (7.5, 9.75)
    places[8, 6] = (0, 0)
    light = np.random.default_rng(2).uniform(0.1, 0.3, (*CAMERA, 2)).astype(np.float32)
    light[~np.isfinite(places[..., 0])] = 0
    return replace(base, second_place=places, second_direct=light)


def without(transport):
    return replace(transport, second_place=None, second_direct=None)


def lights():
    generator = np.random.default_rng(4)
    return generator.random(PROJECTOR, np.float32), generator.random((*PROJECTOR, 2), np.float32)


def test_it_is_light_at_its_place(transport):
    changed = (transport.dense() - without(transport).dense()).reshape(*CAMERA, 2, *PROJECTOR)
    np.testing.assert_allclose(changed.sum(axis=(3, 4)), transport.second_direct, atol=1e-6)
    assert np.count_nonzero(changed[2, 4]) == 2 * 4
    seen = changed[2, 4, 0] / transport.second_direct[2, 4, 0]
    np.testing.assert_allclose(seen[7:9, 9:11], [[0.125, 0.375], [0.125, 0.375]], atol=1e-6)
    assert not changed[1].any()


@pytest.mark.parametrize("light", lights(), ids=["grey", "coloured"])
def test_all_ways_to_relight_agree(transport, light):
    rows = transport.dense().astype(np.float64)
    flat = np.broadcast_to(np.moveaxis(light.reshape(PROJECTOR.pixels, -1), 1, 0), (2, 234))
    expected = np.einsum("cip,ip->ci", rows, flat).reshape(*CAMERA, 2)
    np.testing.assert_allclose(transport @ light, expected, atol=1e-5)
    np.testing.assert_allclose(transport.pictures(light[None])[0], expected, atol=1e-5)
    prepared = nearfar.prepare_transport(transport)
    assert prepared.nbytes > nearfar.prepare_transport(without(transport)).nbytes
    np.testing.assert_allclose(prepared @ light, expected, atol=1e-5)
    direct = transport.components(light).direct - without(transport).components(light).direct
    np.testing.assert_allclose(direct, expected - (without(transport) @ light), atol=1e-5)
    halved = transport.with_gains(direct=0.5)
    np.testing.assert_allclose(halved @ light, transport.relight(light, direct=0.5), atol=1e-5)
    np.testing.assert_allclose(
        prepared.pictures(light[None], direct=0.5)[0], halved @ light, atol=1e-5
    )


def test_the_adjoint_sends_it_back(transport):
    light, image = lights()[1], np.random.default_rng(5).random((*CAMERA, 2), np.float32)
    sent = np.vdot(transport @ light, image)
    assert sent == pytest.approx(np.vdot(light, transport.adjoint(image)), rel=1e-5)
    one = transport.as_linear_operator(1)
    np.testing.assert_allclose(
        one @ light[..., 1].ravel(), (transport @ light)[..., 1].ravel(), atol=1e-5
    )
    picture = transport.column(3, 0)
    assert picture[2, 3, 0] > without(transport).column(3, 0)[2, 3, 0] + 0.05


@pytest.mark.parametrize("mask", ["within", "ring", "beyond"])
def test_it_is_probed_by_its_distance_from_q(transport, mask):
    chosen = {
        "within": nearfar.ProbingMask.within(6),
        "ring": nearfar.ProbingMask.ring(6, 12),
        "beyond": nearfar.ProbingMask.beyond(12),
    }[mask]
    light = lights()[1]
    q = transport.correspondence.reshape(-1, 2).astype(float)
    places = np.moveaxis(np.indices(PROJECTOR), 0, -1).reshape(-1, 2)
    apart = np.linalg.norm(places - q[:, None], axis=-1)
    allowed = {"within": apart < 6, "ring": (apart >= 6) & (apart < 12), "beyond": apart >= 12}
    flat = np.moveaxis(light.reshape(-1, 2), 1, 0)
    rows = transport.dense().astype(np.float64)
    expected = np.einsum("cip,ip,cp->ci", rows, flat, allowed[mask].astype(float))
    found = nearfar.probe(transport, light, chosen)
    np.testing.assert_allclose(found.reshape(-1, 2), expected, atol=1e-5)


def test_blocks_and_files_keep_it(transport, tmp_path):
    light = lights()[0]
    parts = [of_rows(transport, slice(first, first + 3)) for first in range(0, 9, 3)]
    np.testing.assert_array_equal(stacked(parts) @ light, transport @ light)
    save_transport(transport, tmp_path / "t.zarr")
    np.testing.assert_array_equal(load_transport(tmp_path / "t.zarr") @ light, transport @ light)
    nothing = of_rows(transport, slice(0, 0))
    assert (nothing @ light).shape == (0, CAMERA.width, 2)
    rows = open_transport(tmp_path / "t.zarr").rows(slice(2, 4))
    np.testing.assert_array_equal(rows @ light, (transport @ light)[2:4])
    save_transport(without(transport), tmp_path / "plain.zarr")
    assert load_transport(tmp_path / "plain.zarr").second_place is None


def test_parts_of_which_some_have_none_are_refused(transport):
    parts = [of_rows(transport, slice(0, 4)), of_rows(without(transport), slice(4, 9))]
    for some in (parts, parts[::-1]):
        with pytest.raises(InputError, match="have second places or footprints, and others"):
            stacked(some)


def test_what_a_file_holds_is_told(transport, tmp_path):
    save_transport(transport, tmp_path / "t.zarr")
    save_transport(without(transport), tmp_path / "plain.zarr")
    assert "directly lit, 6.3% from a second place, too" in describe(tmp_path / "t.zarr")
    assert "second place" not in describe(tmp_path / "plain.zarr")


def test_a_physical_split_has_it_as_direct_light(transport):
    light = lights()[1]
    split = nearfar.split_physically(transport)
    found = split.components(light)
    np.testing.assert_allclose(sum(found), transport @ light, atol=1e-5)
    plain = nearfar.split_physically(without(transport)).components(light)
    added = (transport @ light) - (without(transport) @ light)
    has = np.isfinite(transport.second_place[..., 0])
    np.testing.assert_allclose((found.direct - plain.direct)[has], added[has], atol=1e-5)


def test_edits_reach_it(transport):
    matrix = np.array([[0.2, 0.5], [0.0, 1.5]])
    edited = nearfar.recolour(transport, "direct", matrix)
    light = lights()[0]
    before, after = transport.components(light), edited.components(light)
    np.testing.assert_allclose(after.direct, before.direct @ matrix.T, atol=1e-5)
    np.testing.assert_array_equal(after.near, before.near)
    twice = nearfar.recolour(transport, "far", [2.0, 2.0])
    np.testing.assert_array_equal(twice.second_direct, transport.second_direct)


@pytest.mark.parametrize("by_reciprocity", [False, True])
def test_a_dual_view_has_it(transport, by_reciprocity):
    image, plain = np.random.default_rng(6).random((*CAMERA, 2), np.float32), without(transport)
    found = nearfar.find_reciprocity(transport) if by_reciprocity else None
    assert found is None or found.holds
    changed = nearfar.dual_view(transport, image, reciprocity=found)
    changed -= nearfar.dual_view(plain, image, reciprocity=found)
    expected = transport.adjoint(image) - plain.adjoint(image)
    assert np.abs(expected).max() > 0.05
    np.testing.assert_allclose(changed, expected, atol=1e-5)
