"""Transports on the disk: round trips, and every damage a sentence."""

import json
from dataclasses import replace
from pathlib import Path
from shutil import rmtree

import numpy as np
import pytest

from nearfar.arrays import Size, blocks, middles
from nearfar.errors import (
    ExistingOutputError,
    InputError,
    MissingFileError,
    NearfarError,
    UnreadableFileError,
)
from nearfar.illumination.real_basis import real_basis
from nearfar.priors.fitted import LIT_COMPONENTS
from nearfar.transport.exact_store import load_exact, save_exact
from nearfar.transport.model import Transport
from nearfar.transport.posterior import Posterior
from nearfar.transport.quality import Quality
from nearfar.transport.rows import (
    FACTORS,
    POSTERIOR_FIELDS,
    QUALITY_FIELDS,
    of_pixels,
    of_rows,
    stacked,
    thinned_blocks,
)
from nearfar.transport.store import load_transport, save_transport
from nearfar.transport.store_writing import write_verdict
from nearfar.transport.stored import open_transport
from nearfar.transport.verdict import KeptVerdict, Reason, verdict_to_json
from tests.metadata import change_attributes, change_metadata
from tests.transport.test_operators import CAMERA, PROJECTOR, _exact, _transport

DOUBTS = KeptVerdict("doubtful", (Reason("moved", "it moved."),), 31.5, 35.0, 2.2, 1.5)
VERDICT = verdict_to_json(DOUBTS)


@pytest.fixture
def generator():
    return np.random.default_rng(5)


@pytest.fixture
def stored(tmp_path, generator) -> Path:
    path = tmp_path / "t.zarr"
    save_transport(_transport(generator), path)
    return path


def test_a_transport_comes_back(tmp_path, generator):
    transport = _transport(generator)
    save_transport(transport, tmp_path / "t.zarr")
    loaded = load_transport(tmp_path / "t.zarr")
    for name in FACTORS:
        np.testing.assert_array_equal(getattr(loaded, name), getattr(transport, name))
    light = generator.random(PROJECTOR)
    np.testing.assert_array_equal(loaded @ light, transport @ light)


def _believed(transport: Transport) -> Transport:
    """Add a posterior to a transport."""
    generator = np.random.default_rng(2)
    shape = transport.direct.shape
    values = {
        name: generator.random(shape).astype(np.float32)
        for name in ("white", "offset_noise", "light_noise", "share_of_white", "noise_share")
    }
    frequencies = transport.far_basis.frequencies[1:]
    posterior = Posterior(
        prior_components=LIT_COMPONENTS[:3],
        frequencies=frequencies,
        multiplicity=np.arange(real_basis(frequencies, PROJECTOR).count, dtype=np.float32),
        prior_component=generator.integers(0, 3, shape[:2]).astype(np.uint8),
        prior_scale=generator.random(shape[:2]).astype(np.float32),
        **values,
    )
    quality = Quality(
        generator.random(shape[:2]).astype(np.float32), generator.random(shape[:2]) < 0.1
    )
    return replace(transport, posterior=posterior, quality=quality)


def test_what_error_bars_follow_from_comes_back(tmp_path, generator):
    transport = _believed(_transport(generator))
    save_transport(transport, tmp_path / "t.zarr")
    loaded = load_transport(tmp_path / "t.zarr").posterior
    assert loaded.prior_components == transport.posterior.prior_components
    assert loaded.frequencies == transport.posterior.frequencies
    for name in ("multiplicity", *POSTERIOR_FIELDS):
        values = getattr(loaded, name)
        np.testing.assert_array_equal(values, getattr(transport.posterior, name))
        assert values.dtype == getattr(transport.posterior, name).dtype
    for name in QUALITY_FIELDS:
        values = getattr(load_transport(tmp_path / "t.zarr").quality, name)
        np.testing.assert_array_equal(values, getattr(transport.quality, name))
        assert values.dtype == getattr(transport.quality, name).dtype


def test_a_file_of_a_version_before_neighbours_took_off_noise_has_all_of_it(tmp_path, generator):
    path, transport = tmp_path / "t.zarr", _believed(_transport(generator))
    save_transport(transport, path)
    belief = json.loads((path / "zarr.json").read_text())["attributes"]["belief"]
    change_attributes(path, belief={k: v for k, v in belief.items() if k != "added"})
    rmtree(path / "belief_noise_share")
    loaded = load_transport(path)
    np.testing.assert_array_equal(loaded.posterior.noise_share, np.ones_like(transport.black))
    np.testing.assert_array_equal(loaded.posterior.white, transport.posterior.white)


def _middle(whole, step):
    """Rows and columns of the middle of each cell."""
    return [middles(side, step) for side in whole.camera]


@pytest.mark.parametrize("step", [1, 2, 3, 4, 20])
@pytest.mark.parametrize("rows", [1, 2, 4, 5, 9])
def test_blocks_are_thinned_as_the_whole_camera(generator, step, rows):
    whole = _believed(_transport(generator))
    parts = [of_rows(whole, block) for block in blocks(whole.camera.height, rows)]
    found = stacked(list(thinned_blocks(parts, whole.camera.height, step)))
    known = of_pixels(whole, *_middle(whole, step))
    for name in FACTORS:
        np.testing.assert_array_equal(getattr(found, name), getattr(known, name))
    np.testing.assert_array_equal(found.quality.saturated, known.quality.saturated)


def test_a_damaged_quality_gets_a_sentence(tmp_path, generator):
    path = tmp_path / "t.zarr"
    save_transport(_believed(_transport(generator)), path)
    about = path / "quality_saturated" / "zarr.json"
    change_metadata(about, lambda metadata: metadata.update(data_type="uint8"))
    with pytest.raises(UnreadableFileError, match="its quality maps do not fit"):
        load_transport(path)
    about.unlink()
    with pytest.raises(UnreadableFileError, match="quality_saturated"):
        load_transport(path)


@pytest.mark.parametrize("step", [1, 2, 3, 4, 20])
def test_a_thinned_transport_relights_the_middle_of_each_cell(generator, step):
    whole = _believed(_transport(generator))
    light = generator.random(PROJECTOR)
    thin = of_pixels(whole, *_middle(whole, step))
    chosen = np.ix_(*_middle(whole, step))
    assert thin.camera == tuple(-(-side // step) for side in whole.camera)
    np.testing.assert_allclose(thin @ light, (whole @ light)[chosen], rtol=1e-5)
    np.testing.assert_array_equal(thin.quality.saturated, whole.quality.saturated[chosen])
    np.testing.assert_array_equal(thin.posterior.white, whole.posterior.white[chosen])


@pytest.mark.parametrize("length", [1, 2, 3, 4, 5, 30])
def test_middles_are_where_cells_are(length):
    found = middles(11, length)
    for cell, middle in zip(blocks(11, length), found, strict=True):
        # As far from the first as from the last, but for the half pixel of even cells.
        assert 0 <= (cell.stop - 1 - middle) - (middle - cell.start) <= 1
    assert len(middles(0, length)) == 0


def test_a_damaged_posterior_gets_a_sentence(tmp_path, generator):
    path = tmp_path / "t.zarr"
    save_transport(_believed(_transport(generator)), path)
    posterior = json.loads((path / "zarr.json").read_text())["attributes"]["belief"]
    for change, message in (
        ({"kinds": posterior["kinds"][:1]}, "error bars"),
        ({"repeats": [1.0]}, "error bars"),
        ({"frequencies": 3}, "does not describe a transport"),
        ({"kinds": [[1.0, 2.0]]}, "does not describe a transport"),
        ({"kinds": [[10**400] * 3]}, "does not describe a transport"),
        ({"kinds": [[float("nan")] * 3]}, "does not describe a transport"),
        ({"kinds": [[1.0, 2.0, 0]]}, "does not describe a transport"),
        ({"kinds": [[1.0, -2.0, 1.0]]}, "does not describe a transport"),
        ({"kinds": [[1e-9, 2.0, 1.0]]}, "does not describe a transport"),
        ({"repeats": [float("inf")]}, "does not describe a transport"),
        ({"added": 3}, "does not describe a transport"),
    ):
        change_attributes(path, belief={**posterior, **change})
        with pytest.raises(UnreadableFileError, match=message):
            load_transport(path)
    change_attributes(path, belief=posterior)
    chunk = next(p for p in (path / "belief_white").iterdir() if p.name != "zarr.json")
    chunk.unlink()
    with pytest.raises(UnreadableFileError, match=r"t\.zarr"):
        load_transport(path)


@pytest.mark.parametrize("size", [1, 6000, 2**28])
def test_rows_are_read_in_blocks(tmp_path, generator, size):
    transport = _believed(_transport(generator))
    save_transport(transport, tmp_path / "t.zarr")
    stored = open_transport(tmp_path / "t.zarr")
    parts = list(stored.blocks(size))
    assert len(parts) == {1: 9, 6000: 5, 2**28: 1}[size]
    whole = stacked(parts)
    for name in FACTORS:
        np.testing.assert_array_equal(getattr(whole, name), getattr(transport, name))
    for name in POSTERIOR_FIELDS:
        got = getattr(whole.posterior, name)
        np.testing.assert_array_equal(got, getattr(transport.posterior, name))
    for name in QUALITY_FIELDS:
        got = getattr(whole.quality, name)
        np.testing.assert_array_equal(got, getattr(transport.quality, name))
    assert (stored.camera, stored.channels) == (transport.camera, transport.channels)


def test_nothing_is_overwritten_without_force(stored, generator):
    before = load_transport(stored)
    with pytest.raises(ExistingOutputError, match="`force=True`"):
        save_transport(_transport(generator), stored)
    np.testing.assert_array_equal(load_transport(stored).near, before.near)
    save_transport(before.with_gains(near=2.0), stored, force=True)
    np.testing.assert_allclose(load_transport(stored).near, 2 * before.near)


@pytest.mark.parametrize(
    "verdict",
    [DOUBTS, KeptVerdict("good"), replace(DOUBTS, noise_snr=38.0, planned_snr=(33.0, 41.0))],
)
def test_a_verdict_is_kept_with_the_transport(stored, tmp_path, verdict):
    assert open_transport(stored).verdict is None
    assert load_transport(stored).verdict is None
    write_verdict(stored, KeptVerdict("wrong"))
    before = sorted(path.name for path in stored.rglob("*"))
    write_verdict(stored, verdict)
    assert sorted(path.name for path in stored.rglob("*")) == before
    kept = load_transport(stored)
    assert kept.verdict == open_transport(stored).verdict == verdict
    assert open_transport(stored).thinned(2).verdict == verdict
    save_transport(kept, tmp_path / "copy.zarr")
    assert load_transport(tmp_path / "copy.zarr").verdict == verdict
    # Another transport is not what was judged.
    assert kept.with_gains(near=2.0).verdict is None
    assert (2 * kept).verdict is None


def test_a_flipped_bit_of_a_verdict_is_seen(stored):
    write_verdict(stored, DOUBTS)
    metadata = stored / "zarr.json"
    metadata.write_bytes(metadata.read_bytes().replace(b"doubtful", b"good"))
    with pytest.raises(UnreadableFileError, match="checksum"):
        open_transport(stored)


def test_a_verdict_in_words():
    assert str(DOUBTS) == (
        "doubtful: It moved. Relit pictures are off by 2.7 % (held-out SNR_b 31.5 dB, 35.0 dB "
        "expected); error bars are made 1.5 times as wide, to hold."
    )
    assert str(KeptVerdict("good")) == "good:"
    beside = replace(DOUBTS, widening=1.0, noise_snr=38.25, planned_snr=(33.0, 41.0))
    assert str(beside).endswith(
        "(held-out SNR_b 31.5 dB, 35.0 dB expected, planned for 33 to 41 dB under pictures, noise "
        "alone allows 38.2 dB)."
    )
    planned = KeptVerdict("good", planned_snr=(33.0, 41.0))
    assert str(planned) == "good: The plan was chosen for 33 to 41 dB under pictures."


def test_a_verdict_of_an_earlier_nearfar_is_read(stored):
    earlier = {name: VERDICT[name] for name in VERDICT if name not in ("noise_dB", "planned_dB")}
    change_attributes(stored, verdict=earlier)
    assert load_transport(stored).verdict == DOUBTS


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"version": 9}, "version 9, this nearfar reads versions 1 to 4"),
        ({"format": "nearfar capture"}, "not a nearfar transport but a nearfar capture"),
        ({"projector": None}, "does not describe a transport"),
        ({"projector": [3]}, "does not describe a transport"),
        ({"projector": [3, 0]}, "does not describe a transport"),
        ({"projector": [3, 2.0]}, "does not describe a transport"),
        ({"projector": [3, 10**40]}, "does not describe a transport"),
        ({"projector": "x" * 999}, "does not describe a transport .{,300}; reconstruct"),
        ({"far_frequencies": [["1/7"]]}, "does not describe a transport"),
        ({"far_frequencies": [["0", "0"]]}, "its far has shape"),
        ({"provenance": 3}, "does not describe a transport"),
        ({"provenance": {"gains": 2.0}}, "does not describe a transport"),
        ({"provenance": {"gains": {"direct": 2.0, "near": 1.0}}}, "does not describe a transport"),
        (
            {"provenance": {"gains": {"direct": float("nan"), "near": 1.0, "far": 1.0}}},
            "are not finite gains",
        ),
        ({"verdict": "good"}, "does not describe a transport"),
        ({"verdict": {}}, "does not describe a transport"),
        ({"verdict": VERDICT | {"grade": "perfect"}}, "'perfect' is no grade"),
        ({"verdict": VERDICT | {"reasons": 3}}, "does not describe a transport"),
        ({"verdict": VERDICT | {"reasons": ["moved"]}}, "does not describe a transport"),
        ({"verdict": VERDICT | {"reasons": [{"cause": 1, "sentence": ""}]}}, "is no text"),
        ({"verdict": VERDICT | {"held_out_dB": float("nan")}}, "no number from -1000"),
        ({"verdict": VERDICT | {"expected_dB": "x"}}, "no number from -1000"),
        ({"verdict": VERDICT | {"noise_dB": 2000.0}}, "no number from -1000"),
        ({"verdict": VERDICT | {"planned_dB": [30.0]}}, "does not describe a transport"),
        ({"verdict": VERDICT | {"planned_dB": [30.0, "x"]}}, "no number from -1000"),
        ({"verdict": VERDICT | {"error_ratio": -1.0}}, "no number from 0"),
        ({"verdict": VERDICT | {"widening": 0.5}}, "no number from 1"),
        ({"verdict": VERDICT | {"widening": 10**400}}, "does not describe a transport"),
    ],
)
def test_damaged_attributes_get_a_sentence(stored, changes, message):
    change_attributes(stored, **changes)
    with pytest.raises(UnreadableFileError, match=message):
        load_transport(stored)


@pytest.mark.parametrize("name", FACTORS)
def test_a_missing_or_damaged_factor_gets_a_sentence(stored, name):
    chunk = next(path for path in (stored / name).iterdir() if path.name != "zarr.json")
    data = chunk.read_bytes()
    for damaged in (None, data[: len(data) // 2], data[:-9] + bytes(9)):
        if damaged is None:
            chunk.unlink()
        else:
            chunk.write_bytes(damaged)
        with pytest.raises(UnreadableFileError, match=r"t\.zarr"):
            load_transport(stored)


def test_what_is_not_there_or_something_else_gets_a_sentence(tmp_path):
    with pytest.raises(MissingFileError, match="is not there"):
        load_transport(tmp_path / "t.zarr")
    (tmp_path / "folder").mkdir()
    with pytest.raises(UnreadableFileError, match="not a nearfar transport"):
        load_transport(tmp_path / "folder")
    (tmp_path / "file").write_text("x")
    with pytest.raises(UnreadableFileError):
        load_transport(tmp_path / "file")


def test_an_exact_transport_comes_back(tmp_path, generator):
    exact = _exact(generator, channels=2)
    save_exact(exact, tmp_path / "e.zarr")
    loaded = load_exact(tmp_path / "e.zarr")
    assert (loaded.projector, loaded.camera, loaded.name) == (PROJECTOR, CAMERA, exact.name)
    np.testing.assert_array_equal(loaded.far, exact.far)
    for mine, theirs in zip(
        (*loaded.direct, *loaded.near), (*exact.direct, *exact.near), strict=True
    ):
        np.testing.assert_allclose(mine.toarray(), theirs.toarray(), rtol=1e-6)


def _dense(exact):
    return np.moveaxis(exact.rows(slice(None)), 1, 2)


@pytest.mark.parametrize("layout", ["C P channels", "C P", "apart", "npz", "npz components"])
def test_dense_arrays_are_transports(tmp_path, generator, layout):
    exact = _exact(generator, channels=1 if layout == "C P" else 2)
    dense = _dense(exact)
    path = tmp_path / ("t.npz" if layout.startswith("npz") else "t.npy")
    given = {"projector": PROJECTOR, "camera": CAMERA}
    if layout == "C P":
        np.save(path, dense[..., 0])
    elif layout == "C P channels":
        np.save(path, dense)
    elif layout == "apart":
        np.save(path, dense.reshape(*CAMERA, *PROJECTOR, 2))
        given = {}
    elif layout == "npz":
        np.savez(path, T=dense, projector=PROJECTOR, camera=CAMERA)
        given = {}
    else:
        parts = [np.moveaxis(part, 1, 2) for part in exact.component_rows(slice(None))]
        np.savez(
            path,
            direct=parts[0],
            near=parts[1],
            far=parts[2],
            projector=PROJECTOR,
            camera=CAMERA,
        )
        given = {}
    loaded = load_exact(path, **given)
    light = generator.random(PROJECTOR, dtype=np.float32)
    np.testing.assert_allclose(loaded @ light, exact @ light, rtol=1e-4)
    assert loaded.is_apart == (layout == "npz components")


def test_the_camera_of_a_dense_transport_is_told_by_its_rows(tmp_path):
    np.save(tmp_path / "t.npy", np.ones((4 * 12, 12), np.float32))
    assert load_exact(tmp_path / "t.npy", projector=Size(3, 4)).camera == Size(6, 8)


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (np.ones((12, 13)), "13 columns"),
        (np.ones((13, 12)), "13 rows, from which no camera size"),
        (np.ones((12, 12, 5)), "a dense transport is"),
        (np.full((12, 12), np.nan), "NaN"),
        (np.ones(12), "a dense transport is"),
        # Channels come last.
        (np.ones((3, 12, 13)), r"has shape \(3, 12, 13\): .* \(C, P, channels\)"),
        (
            np.ones((3, 2, 4, 3, 5)),
            r"has shape \(3, 2, 4, 3, 5\): .* \(Cy, Cx, Py, Px, channels\).* numpy\.moveaxis",
        ),
        (np.array(["a"]), "not numbers"),
    ],
)
def test_a_dense_array_that_is_no_transport_gets_a_sentence(tmp_path, array, message):
    np.save(tmp_path / "t.npy", array)
    with pytest.raises(InputError, match=message):
        load_exact(tmp_path / "t.npy", projector=Size(3, 4))


def test_pickles_and_garbage_are_not_read(tmp_path):
    np.save(tmp_path / "t.npy", np.array([{}], dtype=object), allow_pickle=True)
    (tmp_path / "u.npy").write_bytes(b"not numpy")
    (tmp_path / "v.npz").write_bytes(b"PK not a zip")
    np.savez(tmp_path / "w.npz", other=np.ones(3))
    for name in ("t.npy", "u.npy", "v.npz", "w.npz", "missing.npy"):
        with pytest.raises(NearfarError, match=name):
            load_exact(tmp_path / name, projector=Size(3, 4))


@pytest.mark.parametrize(
    "sizes",
    [
        {"projector": (16, 20, 3)},
        {"camera": ("a", "b")},
        {"projector": (0, 12)},
        {"projector": 3.0},
    ],
)
def test_sizes_that_are_none_get_a_sentence(tmp_path, sizes):
    np.savez(tmp_path / "t.npz", T=np.ones((12, 12), np.float32), **sizes)
    with pytest.raises(InputError, match="that is no size"):
        load_exact(tmp_path / "t.npz", projector=Size(3, 4))


def test_a_channel_that_is_missing_is_missed(tmp_path, generator):
    save_exact(_exact(generator, channels=2), tmp_path / "e.zarr")
    (tmp_path / "e.zarr" / "far-1" / "zarr.json").unlink()
    with pytest.raises(UnreadableFileError, match=r"e\.zarr"):
        load_exact(tmp_path / "e.zarr")
