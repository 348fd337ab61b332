"""Transports that lack parts: nothing is kept of these, and nothing is asked of them."""

import json
from dataclasses import replace
from shutil import rmtree

import numpy as np
import pytest

import nearfar
from nearfar.arrays import Size
from nearfar.errors import InputError, UnreadableFileError
from nearfar.illumination.real_basis import basis_of_every_frequency, real_basis
from nearfar.transport.model import Transport
from nearfar.transport.parts import USUAL_PARTS
from nearfar.transport.plots import Plots
from nearfar.transport.posterior import FreePosterior
from nearfar.transport.store import load_transport, save_transport
from nearfar.transport.stored import open_transport
from tests.metadata import change_attributes
from tests.worlds import model_transport

PROJECTOR, CAMERA = Size(3, 5), Size(6, 7)


@pytest.fixture(scope="module")
def rows():
    """Light from each lamp, without direct light: (Cy, Cx, channels, P)."""
    return np.random.default_rng(0).random((*CAMERA, 2, 15)).astype(np.float32)


@pytest.fixture(scope="module")
def free(rows):
    generator = np.random.default_rng(1)
    shape = (*CAMERA, 2)
    q = np.stack([generator.integers(0, side, CAMERA) for side in PROJECTOR], axis=-1).astype(
        np.float32
    )
    basis = basis_of_every_frequency(PROJECTOR)
    return Transport(
        projector=PROJECTOR,
        correspondence=q,
        direct=generator.random(shape).astype(np.float32),
        near=np.zeros((*shape, 0, 0), np.float32),
        far=rows @ basis.patterns.T,
        far_basis=basis,
        black=np.zeros(shape, np.float32),
        noise=np.full(shape, 0.01, np.float32),
        parts=("direct", "free"),
        posterior=FreePosterior(
            modes=np.linalg.qr(generator.normal(size=(15, 4)))[0].T.astype(np.float32),
            strengths=np.arange(4, 0, -1).astype(np.float32),
            mean=np.full(15, 0.1, np.float32),
            mean_variance=0.5,
            gain_errors=np.zeros((0, 15), np.float32),
            variance_ratio=generator.random(CAMERA).astype(np.float32),
        ),
    )


@pytest.fixture(scope="module")
def dense(free, rows):
    """The same as a matrix, (C, channels, P)."""
    found = rows.reshape(-1, 2, 15).copy()
    q = free.correspondence.reshape(-1, 2).astype(int)
    found[np.arange(len(found)), :, q[:, 0] * 5 + q[:, 1]] += free.direct.reshape(-1, 2)
    return found


def test_free_rows_relight_lamp_by_lamp(free, dense):
    light = np.random.default_rng(2).random(PROJECTOR).astype(np.float32)
    expected = (dense @ light.ravel()).reshape(*CAMERA, 2)
    np.testing.assert_allclose(free @ light, expected, rtol=1e-4)
    np.testing.assert_allclose(free.pictures(light[None])[0], expected, rtol=1e-4)
    np.testing.assert_allclose(free.dense(), dense, atol=1e-5)
    prepared = nearfar.prepare_transport(free)
    np.testing.assert_allclose(prepared @ light, expected, rtol=1e-4)
    back = free.H @ expected
    np.testing.assert_allclose(
        back[..., 0].ravel(), dense[:, 0].T @ expected[..., 0].ravel(), rtol=1e-4
    )


def test_gains_are_of_the_parts_that_are_there(free):
    light = np.ones(PROJECTOR, np.float32)
    twice = free.relight(light, free=2.0) - free @ light
    np.testing.assert_allclose(twice, free.components(light).far, rtol=1e-4)
    with pytest.raises(InputError, match="no part 'near'"):
        free.relight(light, near=0.0)
    with pytest.raises(InputError, match="no part 'far'"):
        free.with_gains(far=2.0)
    np.testing.assert_allclose((2 * free) @ light, 2 * (free @ light), rtol=1e-5)
    usual = model_transport(Size(8, 8), Size(4, 4), window=3, far=Size(3, 3))
    with pytest.raises(InputError, match="no part 'free'"):
        usual.relight(np.ones((8, 8)), free=2.0)


def test_a_file_holds_nothing_of_an_absent_part(free, tmp_path):
    path = tmp_path / "t.zarr"
    save_transport(free, path)
    assert not (path / "near").exists()
    kept = load_transport(path)
    assert kept.parts == ("direct", "free")
    assert kept.near.shape == (*CAMERA, 2, 0, 0)
    light = np.random.default_rng(4).random(PROJECTOR).astype(np.float32)
    np.testing.assert_array_equal(kept @ light, free @ light)
    some = open_transport(path).rows(slice(2, 4))
    np.testing.assert_array_equal(some @ light, (free @ light)[2:4])
    for name in ("modes", "strengths", "mean", "mean_variance", "variance_ratio"):
        of_file, made = (getattr(each.posterior, name) for each in (kept, free))
        np.testing.assert_array_equal(of_file, made)


@pytest.mark.parametrize(
    "change", [{"of": "glass"}, {"mean_variance": -1.0}, {"mean_variance": float("nan")}]
)
def test_a_damaged_posterior_gets_a_sentence(free, tmp_path, change):
    path = tmp_path / "t.zarr"
    save_transport(free, path)
    kept = json.loads((path / "zarr.json").read_text())["attributes"]["belief"]
    change_attributes(path, belief={**kept, **change})
    with pytest.raises(UnreadableFileError, match="does not describe a transport"):
        load_transport(path)
    change_attributes(path, belief=kept)
    rmtree(path / "belief_modes")
    with pytest.raises(UnreadableFileError, match="belief_modes"):
        load_transport(path)


def test_a_posterior_of_another_projector_gets_a_sentence(free, tmp_path):
    few = replace(free.posterior, strengths=free.posterior.strengths[:-1])
    save_transport(replace(free, posterior=few), tmp_path / "t.zarr")
    with pytest.raises(UnreadableFileError, match="is of another projector"):
        load_transport(tmp_path / "t.zarr")


def test_a_transport_without_far_range_has_no_coefficients(tmp_path):
    usual = model_transport(Size(8, 8), Size(4, 4), window=3, far=Size(3, 3))
    without = replace(
        usual,
        far=usual.far[..., :0],
        far_basis=real_basis([], usual.projector),
        parts=("direct", "near"),
    )
    light = np.random.default_rng(5).random((8, 8)).astype(np.float32)
    parts = usual.components(light)
    np.testing.assert_allclose(without @ light, parts.direct + parts.near, rtol=1e-5)
    save_transport(without, tmp_path / "t.zarr")
    np.testing.assert_array_equal(load_transport(tmp_path / "t.zarr") @ light, without @ light)
    assert not (tmp_path / "t.zarr" / "far").exists()


@pytest.mark.parametrize("parts", [[], ["near", "direct"], ["far", "free"], ["glass"], 3])
def test_a_file_of_no_such_parts_is_damaged(free, tmp_path, parts):
    save_transport(free, tmp_path / "t.zarr")
    change_attributes(tmp_path / "t.zarr", parts=parts)
    with pytest.raises(UnreadableFileError, match="damaged"):
        load_transport(tmp_path / "t.zarr")


def test_a_notebook_shows_the_parts_that_are_there(free):
    shown = free._repr_html_()
    assert "free" in shown
    assert "near" not in shown.replace("nearfar", "")
    assert USUAL_PARTS == ("direct", "near", "far")


def test_drawings_are_of_the_parts_that_are_there(free):
    drawn = Plots(free).components(np.ones(PROJECTOR, np.float32))
    assert [ax.get_title() for ax in drawn] == ["direct", "free"]
