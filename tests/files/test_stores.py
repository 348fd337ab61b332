"""A damaged store gives a sentence, never zeros."""

import asyncio
import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier
from typing import Any

import numpy as np
import pytest
import zarr
from zarr.core.sync import loop as zarr_loop

from nearfar.errors import InputError, MissingFileError, UnreadableFileError
from nearfar.files import kind_of_store
from nearfar.files.checksums import CHECKSUM
from nearfar.files.stores import (
    add_array,
    add_to_store,
    create_durable_store,
    create_store,
    open_array,
    open_durable_store,
    open_store,
    read_array,
    read_selection,
)

KIND = "nearfar test"
VALUES = np.random.default_rng(0).integers(0, 9, (5, 6, 7)).astype(np.uint16)
VALUES[2] = 0


@pytest.fixture(params=[create_store, create_durable_store])
def store(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    path = tmp_path / "a.zarr"
    group = request.param(path, KIND, 1, {"note": [1, "two"]})
    add_array(group, "a", VALUES.shape, VALUES.dtype, (1, 6, 7))[:] = VALUES
    add_array(group, "b", (3,), np.float32, (3,))[:] = [0, -1.5, 2]
    return path


def chunk(path: Path, index: int) -> Path:
    return path / "a" / f"c.{index}.0.0"


def test_what_is_written_is_read(store: Path) -> None:
    group = open_store(store, KIND, 1)
    assert dict(group.attrs) == {"format": KIND, "version": 1, "note": [1, "two"]}
    np.testing.assert_array_equal(read_array(group, "a"), VALUES)
    np.testing.assert_array_equal(read_array(group, "b"), [0, -1.5, 2])
    np.testing.assert_array_equal(
        read_array(group, "a", ([4, 0], slice(1, 3))), VALUES[[4, 0], 1:3]
    )
    np.testing.assert_array_equal(read_array(group, "a", (3, slice(None), -1)), VALUES[3, :, -1])
    np.testing.assert_array_equal(read_selection(open_array(group, "a"), slice(2)), VALUES[:2])
    assert sorted(p.name for p in (store / "a").iterdir()) == [
        *(f"c.{i}.0.0" for i in range(5)),
        "zarr.json",
    ]


def test_a_selection_outside_is_refused(store: Path) -> None:
    group = open_store(store, KIND, 1)
    for selection in (5, [0, 9], (0, 0, 0, 0)):
        with pytest.raises(InputError, match="no such part of a"):
            read_array(group, "a", selection)


@pytest.mark.parametrize("index", [0, 2, 4])
def test_a_missing_chunk_is_an_error(store: Path, index: int) -> None:
    chunk(store, index).unlink()
    group = open_store(store, KIND, 1)
    with pytest.raises(UnreadableFileError, match=rf"a\.zarr is damaged: a/c\.{index}\.0\.0 is"):
        read_array(group, "a")
    np.testing.assert_array_equal(read_array(group, "a", [1, 3]), VALUES[[1, 3]])


def test_a_chunk_cut_or_changed_anywhere_is_an_error(store: Path) -> None:
    whole = chunk(store, 1).read_bytes()
    group = open_store(store, KIND, 1)
    bad = [whole[:length] for length in range(0, len(whole), 2)]
    bad += [
        bytes(b ^ (16 if i == position else 0) for i, b in enumerate(whole))
        for position in range(0, len(whole), 3)
    ]
    for data in bad:
        chunk(store, 1).write_bytes(data)
        with pytest.raises(UnreadableFileError, match=r"a\.zarr is damaged: array a") as caught:
            read_array(group, "a")
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["zarr.json", "a/zarr.json"])
def test_metadata_cut_or_changed_anywhere_are_an_error_or_harmless(store: Path, name: str) -> None:
    whole = (store / name).read_bytes()
    attributes = {"format": KIND, "version": 1, "note": [1, "two"]}
    bad = [whole[:length] for length in range(0, len(whole) - 2, 19)]
    bad += [
        bytes(b ^ (bit if i == position else 0) for i, b in enumerate(whole))
        for position in range(0, len(whole), 5)
        for bit in (1, 16)
    ]
    refused = 0
    for data in bad:
        (store / name).write_bytes(data)
        try:
            group = open_store(store, KIND, 1)
            read = read_array(group, "a")
        except UnreadableFileError as error:
            assert "a.zarr" in str(error)
            refused += 1
        else:
            # The key of the checksum was hit, and nothing else.
            assert read.dtype == VALUES.dtype
            np.testing.assert_array_equal(read, VALUES)
            assert attributes.items() <= dict(group.attrs).items()
    assert refused >= 0.9 * len(bad)


@pytest.mark.parametrize("name", ["zarr.json", "a/zarr.json"])
def test_metadata_edited_by_hand_are_refused_as_such(store: Path, name: str) -> None:
    metadata = json.loads((store / name).read_text())
    metadata["attributes"]["note"] = [1, "three"]
    (store / name).write_text(json.dumps(metadata))
    with pytest.raises(UnreadableFileError, match=rf"its {name} is not as it was .* by hand"):
        read_array(open_store(store, KIND, 1), "a")


@pytest.mark.parametrize("name", ["zarr.json", "a/zarr.json"])
def test_metadata_without_a_checksum_are_read(store: Path, name: str) -> None:
    """Nearfar wrote none at first."""
    metadata = json.loads((store / name).read_text())
    del metadata["attributes"][CHECKSUM]
    (store / name).write_text(json.dumps(metadata))
    np.testing.assert_array_equal(read_array(open_store(store, KIND, 1), "a"), VALUES)


def test_metadata_laid_out_otherwise_are_the_same(store: Path) -> None:
    metadata = json.loads((store / "zarr.json").read_text())
    (store / "zarr.json").write_text(json.dumps(dict(reversed(metadata.items()))))
    assert open_store(store, KIND, 1).attrs["note"] == [1, "two"]


def test_a_checksum_is_that_of_attributes_added_later(tmp_path: Path) -> None:
    path = tmp_path / "a.zarr"
    create_durable_store(path, KIND, 1)
    open_durable_store(path).attrs["note"] = 3
    assert open_store(path, KIND, 1).attrs["note"] == 3
    text = (path / "zarr.json").read_text()
    (path / "zarr.json").write_text(text.replace('"note": 3', '"note": 2'))
    with pytest.raises(UnreadableFileError, match="is not as it was written"):
        open_store(path, KIND, 1)
    with pytest.raises(UnreadableFileError, match="is not as it was written"):
        open_durable_store(path)


@pytest.mark.parametrize("fault", ["missing", "changed"])
def test_after_a_fault_nothing_of_other_chunks_is_left_going(tmp_path: Path, fault: str) -> None:
    # Python complains of each that is, if the process ends then.
    path = tmp_path / "a.zarr"
    group = create_store(path, KIND, 1)
    values = np.random.default_rng(0).integers(0, 999, (300, 40, 40)).astype(np.uint16)
    add_array(group, "a", values.shape, values.dtype, (1, 40, 40))[:] = values
    if fault == "missing":
        chunk(path, 1).unlink()
    else:
        damaged = bytearray(chunk(path, 1).read_bytes())
        damaged[20] ^= 0xFF
        chunk(path, 1).write_bytes(damaged)
    for _ in range(3):
        with pytest.raises(UnreadableFileError):
            read_array(open_store(path, KIND, 1), "a")
        (loop,) = zarr_loop
        assert loop is not None
        assert not asyncio.all_tasks(loop)


def test_a_missing_array_is_an_error(store: Path) -> None:
    group = open_store(store, KIND, 1)
    with pytest.raises(UnreadableFileError, match=r"a\.zarr is damaged: array nothing"):
        read_array(group, "nothing")
    create_store(store / "inner", KIND, 1)
    with pytest.raises(UnreadableFileError, match="inner is no array"):
        read_array(group, "inner")


def test_other_things_get_a_sentence(store: Path, tmp_path: Path) -> None:
    with pytest.raises(MissingFileError, match=r"no\.zarr is not there"):
        open_store(tmp_path / "no.zarr", KIND, 1)
    (tmp_path / "file.zarr").write_text("text")
    (tmp_path / "empty.zarr").mkdir()
    zarr.create_group(tmp_path / "two.zarr", zarr_format=2)
    for name in ("file.zarr", "empty.zarr", "two.zarr"):
        with pytest.raises(UnreadableFileError, match=f"{name} is not a {KIND}: it is no Zarr"):
            open_store(tmp_path / name, KIND, 1)
    with pytest.raises(UnreadableFileError, match="is not a nearfar capture but a nearfar test"):
        open_store(store, "nearfar capture", 1)
    with pytest.raises(UnreadableFileError, match="of version 1, this nearfar reads version 2"):
        open_store(store, KIND, 2)
    zarr.create_group(tmp_path / "other.zarr", zarr_format=3)
    with pytest.raises(UnreadableFileError, match="is not a nearfar test but of another kind"):
        open_store(tmp_path / "other.zarr", KIND, 1)
    zarr.create_array(tmp_path / "array.zarr", shape=(3,), dtype="u1", zarr_format=3)
    with pytest.raises(UnreadableFileError, match=r"array\.zarr"):
        open_store(tmp_path / "array.zarr", KIND, 1)


def test_metadata_that_is_no_table_is_an_error(store: Path) -> None:
    tables: tuple[Any, ...] = (
        [],
        3,
        {},
        {"attributes": 3},
        {"zarr_format": 3, "node_type": "tree"},
    )
    for data in tables:
        (store / "zarr.json").write_text(json.dumps(data))
        with pytest.raises(UnreadableFileError, match=r"a\.zarr"):
            open_store(store, KIND, 1)


def test_a_store_says_its_kind(store: Path, tmp_path: Path) -> None:
    assert kind_of_store(store) == KIND
    assert kind_of_store(tmp_path) is None
    assert kind_of_store(tmp_path / "no") is None


def test_a_store_is_read_only(store: Path) -> None:
    array = open_array(open_store(store, KIND, 1), "a")
    with pytest.raises(ValueError, match="read-only"):
        array[0] = 1


def test_writers_that_race_lay_a_store_out_once(tmp_path):
    """Workers of a cluster all begin at once."""
    writers = 6
    together = Barrier(writers)

    def write(path, row):
        together.wait()
        group = add_to_store(path, KIND, 1, {"about": 3})
        add_array(group, "values", (writers, 4), np.float32, (1, 4))[row : row + 1] = row

    for number in range(30):
        path = tmp_path / f"{number}.zarr"
        with ThreadPoolExecutor(writers) as pool:
            list(pool.map(write, [path] * writers, range(writers)))
        written = read_array(open_store(path, KIND, 1), "values")
        np.testing.assert_array_equal(written[:, 0], np.arange(writers))
