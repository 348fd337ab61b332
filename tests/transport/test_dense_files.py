"""Dense transports of any origin: every file and shape that holds one gives the same."""

import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import zarr

from nearfar.arrays import Size
from nearfar.errors import InputError, UnreadableFileError
from nearfar.files import kind_of_store
from nearfar.transport.exact import ExactTransport
from nearfar.transport.exact_store import load_exact, save_exact

PROJECTOR, CAMERA, CHANNELS = Size(3, 5), Size(4, 2), 3
GRID = np.random.default_rng(5).uniform(size=(*CAMERA, *PROJECTOR, CHANNELS)).astype(np.float32)
FLAT = GRID.reshape(CAMERA.pixels, PROJECTOR.pixels, CHANNELS)
SIZES = {"projector": PROJECTOR, "camera": CAMERA}


def _zarr(path: Path, values: np.ndarray, version: int = 3) -> Path:
    zarr.create_array(
        str(path), data=values, chunks=(1,) * values.ndim, zarr_format=version, fill_value=0
    )
    return path


def _npy(path: Path, values: np.ndarray) -> Path:
    np.save(path, values)
    return path


def _npz(path: Path, **arrays: np.ndarray) -> Path:
    np.savez(path, **arrays)
    return path


@pytest.mark.parametrize(
    ("write", "sizes"),
    [
        (lambda at: _npy(at / "t.npy", GRID), {}),
        (lambda at: _npy(at / "t.npy", FLAT.astype(np.float64)), SIZES),
        (lambda at: _npz(at / "t.npz", T=GRID), {}),
        (lambda at: _npz(at / "t.npz", responses=GRID), {}),
        (lambda at: _npz(at / "t.npz", A=FLAT, projector=PROJECTOR, camera=CAMERA), {}),
        (lambda at: _zarr(at / "t.zarr", GRID), {}),
        (lambda at: _zarr(at / "t.zarr", FLAT), SIZES),
        (lambda at: _zarr(at / "t.zarr", GRID, 2), {}),
    ],
)
def test_every_file_gives_the_same(tmp_path: Path, write, sizes):
    found = load_exact(write(tmp_path), **sizes)
    assert (found.projector, found.camera, found.channels) == (PROJECTOR, CAMERA, CHANNELS)
    np.testing.assert_array_equal(found.rows(slice(None)), np.moveaxis(FLAT, 2, 1))
    assert not found.is_apart


def test_one_row_or_column_and_no_channel(tmp_path: Path):
    for projector in (Size(1, 15), Size(15, 1)):
        grid = GRID[..., 0].reshape(*CAMERA, *projector)
        found = load_exact(_npy(tmp_path / "t.npy", grid))
        assert (found.projector, found.channels) == (projector, 1)


def test_zeros_that_zarr_leaves_out_are_zeros(tmp_path: Path):
    dark = GRID.copy()
    dark[1:] = 0
    path = _zarr(tmp_path / "t.zarr", dark)
    assert kind_of_store(path) is None
    np.testing.assert_array_equal(load_exact(path).rows(slice(2, None)), 0)


def test_what_holds_no_transport_is_refused(tmp_path: Path):
    mat = tmp_path / "t.mat"
    mat.write_bytes(b"MATLAB 5.0 MAT-file")
    with pytest.raises(UnreadableFileError, match=r"of no kind that .* as \.npy or \.npz, or as a"):
        load_exact(mat)
    with pytest.raises(InputError, match="holds A, B but no T"):
        load_exact(_npz(tmp_path / "t.npz", A=GRID, B=GRID))
    with pytest.raises(InputError, match="15 columns: give `projector`"):
        load_exact(_npy(tmp_path / "t.npy", FLAT))
    broken = _zarr(tmp_path / "t.zarr", GRID)
    (broken / "c" / "0" / "0" / "0" / "0" / "0").write_bytes(b"no chunk")
    with pytest.raises(UnreadableFileError, match="is damaged"):
        load_exact(broken)


def test_a_scene_is_read_without_a_second_copy_of_it(tmp_path: Path):
    # So large that the chunks in flight, which depend on threads, are a small part of it.
    far = np.zeros((1, 8192, 2048), dtype=np.float32)
    save_exact(ExactTransport(Size(32, 64), Size(128, 64), (), (), far), tmp_path / "t.zarr")
    tracemalloc.start()
    try:
        found = load_exact(tmp_path / "t.zarr")
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert found.far.shape == far.shape
    assert peak < 1.7 * far.nbytes
