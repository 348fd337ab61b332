"""A second transport beside the first, and maps by photos: what the viewer's server has of them."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

from nearfar.arrays import Size
from nearfar.capture import open_capture
from nearfar.errors import InputError, UnreadableFileError
from nearfar.transport.exact import ExactTransport
from nearfar.transport.exact_store import load_exact, save_exact
from nearfar.transport.store import save_transport
from nearfar.transport.stored import open_transport
from nearfar.viewer.beside import open_beside
from nearfar.viewer.held_out import photo_maps
from nearfar.viewer.interactive import InteractiveTransport
from nearfar.viewer.physical import PhysicalRelighting
from nearfar.viewer.tools import tools_of
from nearfar.workflow.diagnosis.misfit import fit_photos, serves
from nearfar.workflow.evaluate import exposure_of
from nearfar.workflow.reconstruction.sources import photos_without_drift
from tests.cli.conftest import run_nearfar
from tests.viewer.asking import CAMERA, PROJECTOR, ask, message, unpack
from tests.viewer.conftest import served_view
from tests.worlds import model_transport

# A second transport


@pytest.fixture(scope="module")
def first(stored):
    return InteractiveTransport(stored)


def _picture(first, path, light, **header):
    """Let the server relight a second transport; gives its components in photo units."""
    beside = open_beside(path, first)
    tools = tools_of(PhysicalRelighting(first), beside)
    *_, found = tools["beside"](first, message(light, **header))
    header, (halves,) = unpack(found)
    return beside, halves.astype(np.float32) / header["scale"]


def test_another_reconstruction_comes_in_its_components(first, transport, lights, tmp_path):
    other = replace(transport, far=1.5 * transport.far)
    save_transport(other, tmp_path / "other.zarr")
    beside, parts = _picture(first, tmp_path / "other.zarr", lights["spot"], colour=[1.0, 0.5, 0.0])
    assert (beside.name, beside.is_apart, beside.remark) == ("other.zarr", True, "")
    expected = np.stack(other.components(lights["spot"][..., None] * [1.0, 0.5, 0.0]))
    np.testing.assert_allclose(parts, expected, rtol=1e-3, atol=2e-5)


def test_a_dense_truth_comes_at_the_first_ones_exposure(first, transport, lights, tmp_path):
    rows = transport.rows(slice(None))
    np.savez(tmp_path / "T.npz", T=np.moveaxis(3 * rows, 1, 2), camera=CAMERA, projector=PROJECTOR)
    beside, parts = _picture(first, tmp_path / "T.npz", lights["random"])
    truth = load_exact(tmp_path / "T.npz")
    exposure = exposure_of(transport, truth)
    assert (len(parts), beside.is_apart) == (1, False)
    expected = exposure.factor * (truth @ lights["random"])
    np.testing.assert_allclose(parts[0], expected, rtol=1e-3, atol=1e-4)
    # The exposure is fitted where the rig recorded none, and the page says so.
    provenance = {**transport.provenance, "rig": {"name": "a real one"}}
    save_transport(replace(transport, provenance=provenance), tmp_path / "real.zarr")
    real = InteractiveTransport(tmp_path / "real.zarr")
    beside, parts = _picture(real, tmp_path / "T.npz", lights["random"])
    assert beside.remark == "T.npz times 0.3333, the exposure that fits best"
    np.testing.assert_allclose(parts[0], transport @ lights["random"], rtol=2e-3, atol=1e-4)


def test_an_exact_transport_of_parts_keeps_them_apart(first, transport, lights, tmp_path):
    d, n, f = transport.component_rows(slice(None))
    direct, near = (
        tuple(sparse.csr_array(part[:, channel]) for channel in range(3)) for part in (d, n)
    )
    truth = ExactTransport(PROJECTOR, CAMERA, direct, near, np.moveaxis(f, 1, 0), "truth")
    save_exact(truth, tmp_path / "truth.zarr")
    _, parts = _picture(first, tmp_path / "truth.zarr", lights["spot"])
    factor = exposure_of(transport, truth).factor
    expected = factor * np.stack(truth.component_pictures(lights["spot"]))
    np.testing.assert_allclose(parts, expected, rtol=1e-3, atol=1e-4)


def test_what_does_not_fit_beside_it_gets_a_sentence(first, stored, tmp_path):
    small = model_transport(Size(8, 8), Size(9, 9), window=3, far=Size(3, 3))
    save_transport(small, tmp_path / "small.zarr")
    with pytest.raises(InputError, match=r"9x9 and 1 channel, .* of 20x24, 30x42 and 3: view two"):
        open_beside(tmp_path / "small.zarr", first)
    grey = ExactTransport(
        PROJECTOR, CAMERA, (), (), np.ones((1, CAMERA.pixels, PROJECTOR.pixels), np.float32)
    )
    save_exact(grey, tmp_path / "grey.zarr")
    with pytest.raises(InputError, match=r"1 channel, .* of the same scene and sizes"):
        open_beside(tmp_path / "grey.zarr", first)
    np.save(tmp_path / "dense.npy", np.ones((CAMERA.pixels, 100), np.float32))
    with pytest.raises(InputError, match=r"100 columns, .* of 20x24 has 480: view two"):
        open_beside(tmp_path / "dense.npy", first)
    np.save(tmp_path / "nan.npy", np.full((CAMERA.pixels, PROJECTOR.pixels), np.nan, np.float32))
    with pytest.raises(InputError, match="holds NaN"):
        open_beside(tmp_path / "nan.npy", first)
    with pytest.raises(UnreadableFileError, match="a nearfar capture"):
        open_beside(stored.parent / "capture.zarr", first)
    ran = run_nearfar("view", stored, "--beside", tmp_path / "small.zarr", "--no-browser")
    assert (ran.status, ran.out) == (1, "")
    assert "view two of the same scene and sizes" in ran.err


# Maps by photos


def test_held_out_photos_tell_how_far_each_pixel_is_off(stored, transport):
    capture = open_capture(stored.parent / "capture.zarr")
    maps = photo_maps(open_transport(stored), capture)
    assert list(maps) == ["held-out", "misfit"]
    photos = photos_without_drift(capture, lambda *_: None)
    fits = fit_photos(photos, transport)
    checks = serves(capture.plan, "check")
    off = (fits.photos - fits.relit)[checks].astype(np.float64)
    light = (fits.photos - fits.black)[checks].astype(np.float64)
    share = np.sqrt((off**2).sum(axis=(0, 3)) / (light**2).sum(axis=(0, 3)))
    np.testing.assert_allclose(maps["held-out"].values, 100 * share, rtol=1e-3)
    # Where correspondence was taken away, it is off the most.
    assert maps["held-out"].values[3, 5] == maps["held-out"].values.max()
    with served_view(InteractiveTransport(stored), photo_maps=maps) as address:
        header, (values, _) = unpack(ask(address, "/map/held-out"))
        np.testing.assert_array_equal(values, maps["held-out"].values)
        assert header["unit"] == "%"
        listed = json.loads(ask(address, "/scene"))["maps"]
        assert {"name": "held-out", "title": "off at held-out photos"} in listed


def test_photos_of_another_transport_get_a_sentence(stored, transport, tmp_path):
    plan = {**transport.provenance["plan"], "photos": 7}
    other = replace(transport, provenance={**transport.provenance, "plan": plan})
    save_transport(other, tmp_path / "other.zarr")
    capture = stored.parent / "capture.zarr"
    with pytest.raises(InputError, match="capture"):
        photo_maps(open_transport(tmp_path / "other.zarr"), open_capture(capture))
    ran = run_nearfar("view", tmp_path / "other.zarr", "--capture", capture, "--no-browser")
    assert (ran.status, ran.out) == (1, "")
