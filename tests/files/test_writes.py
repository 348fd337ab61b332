"""Writes that are under way when their folder is given up."""

import shutil
import threading
import time

import numpy as np
import pytest

from nearfar.errors import StorageError
from nearfar.files import new_output, stores
from nearfar.files.stores import (
    add_array,
    add_to_store,
    create_durable_store,
    create_store,
    open_store,
    read_array,
)
from nearfar.files.writes import abandon
from tests.waiting import LONGEST_WAIT


@pytest.mark.parametrize(
    ("create", "name"), [(create_store, "_write"), (create_durable_store, "_write_durably")]
)
def test_writes_under_way_end_before_their_folder_goes(tmp_path, monkeypatch, create, name):
    write, begun, ended, faults = getattr(stores, name), threading.Event(), [], []

    def slow(path, value):
        if ".0." in path.name:
            begun.set()
            time.sleep(0.2)
        try:
            write(path, value)
        except BaseException as fault:
            faults.append(fault)
            raise
        ended.append(path.name)

    with pytest.raises(KeyboardInterrupt), new_output(tmp_path / "a.zarr") as partial:
        group = create(partial, "nearfar test", 1)
        array = add_array(group, "values", (40, 8), np.float32, (1, 8))
        monkeypatch.setattr(stores, name, slow)
        threading.Thread(target=array.__setitem__, args=(..., 1.0), daemon=True).start()
        assert begun.wait(LONGEST_WAIT)
        raise KeyboardInterrupt
    assert faults == []
    assert "c.0.0" in ended
    assert list(tmp_path.iterdir()) == []
    # What had not begun was dropped, and nothing brings the folder back.
    time.sleep(0.3)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_given_up_is_not_made_again(tmp_path):
    partial = tmp_path / "a.zarr"
    group = create_store(partial, "nearfar test", 1)
    abandon(partial)
    shutil.rmtree(partial)
    add_array(group.require_group("part"), "values", (4, 8), np.float32, (1, 8))
    add_array(group, "values", (4, 8), np.float32, (1, 8))[:] = 1.0
    assert list(tmp_path.iterdir()) == []


def test_a_fault_of_the_disk_is_still_a_fault(tmp_path, monkeypatch):
    def full(path, value):
        raise OSError(28, "No space left on device")

    with (
        pytest.raises(StorageError, match="disk is full"),
        new_output(tmp_path / "a.zarr") as partial,
    ):
        group = create_durable_store(partial, "nearfar test", 1)
        array = add_array(group, "values", (4, 8), np.float32, (1, 8))
        monkeypatch.setattr(stores, "_write_durably", full)
        array[:] = 1.0
    assert list(tmp_path.iterdir()) == []


def test_zeros_are_written_into_arrays_that_are_there(tmp_path):
    values = np.zeros((4, 8), dtype=np.float32)
    for _ in range(2):
        group = add_to_store(tmp_path / "a.zarr", "nearfar test", 1)
        add_array(group, "values", (4, 8), np.float32, (2, 8))[:] = values
    read = read_array(open_store(tmp_path / "a.zarr", "nearfar test", 1), "values")
    np.testing.assert_array_equal(read, values)
