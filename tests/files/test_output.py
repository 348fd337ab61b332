"""Outputs appear whole or not at all."""

import contextlib
import errno
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nearfar.errors import ExistingOutputError, InputError, MissingFileError, StorageError
from nearfar.files import new_output, renaming, write_picture
from nearfar.files.stores import add_array, create_durable_store, create_store
from tests.waiting import LONGEST_WAIT


def listing(folder: Path) -> dict[str, bytes]:
    return {
        str(p.relative_to(folder)): p.read_bytes() if p.is_file() else b""
        for p in sorted(folder.rglob("*"))
    }


def write_folder(path: Path, text: str) -> None:
    path.mkdir()
    (path / "inner").mkdir()
    (path / "inner" / "file").write_text(text)


def test_a_file_appears_whole(tmp_path: Path) -> None:
    with new_output(tmp_path / "a.txt") as partial:
        assert partial.name == "a.txt"
        assert partial.parent.name.startswith(".")
        partial.write_text("new")
        assert not (tmp_path / "a.txt").exists()
    assert listing(tmp_path) == {"a.txt": b"new"}


def test_a_folder_appears_whole_and_replaces_only_ours(tmp_path: Path) -> None:
    for text in ("old", "new"):
        with new_output(tmp_path / "a", force=True, replaceable=lambda p: True) as partial:
            write_folder(partial, text)
    assert listing(tmp_path) == {"a": b"", "a/inner": b"", "a/inner/file": b"new"}
    with (
        pytest.raises(ExistingOutputError, match="did not write"),
        new_output(tmp_path / "a", force=True),
    ):
        pytest.fail("the body must not run")


@pytest.mark.parametrize("make_old", [lambda p: p.mkdir(), lambda p: p.write_text("old")])
@pytest.mark.parametrize("folder", [True, False])
def test_an_empty_folder_or_a_file_gives_way(
    tmp_path: Path, make_old: Callable[[Path], Any], folder: bool
) -> None:
    make_old(tmp_path / "a")
    with new_output(tmp_path / "a", force=True) as partial:
        if folder:
            write_folder(partial, "new")
        else:
            partial.write_text("new")
    assert (tmp_path / "a").is_dir() == folder
    assert [p.name for p in tmp_path.iterdir()] == ["a"]


def test_a_zarr_of_ours_gives_way_and_another_does_not(tmp_path: Path) -> None:
    create_store(tmp_path / "a.zarr", "nearfar test", 1)
    create_store(tmp_path / "b.zarr", "somebody else's", 1)
    with new_output(tmp_path / "a.zarr", force=True) as partial:
        create_store(partial, "nearfar test", 2)
    with pytest.raises(ExistingOutputError), new_output(tmp_path / "b.zarr", force=True):
        pytest.fail("the body must not run")


def test_nothing_is_overwritten_without_force(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("old")
    with (
        pytest.raises(ExistingOutputError, match=r"a\.txt exists already: choose another name"),
        new_output(tmp_path / "a.txt"),
    ):
        pytest.fail("the body must not run")


def test_a_missing_folder_and_a_device_are_refused(tmp_path: Path) -> None:
    with pytest.raises(MissingFileError, match="no folder"), new_output(tmp_path / "no" / "a"):
        pytest.fail("the body must not run")
    with pytest.raises(InputError, match="neither"), new_output(Path("/dev/null"), force=True):
        pytest.fail("the body must not run")


def test_a_link_is_followed(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "real" / "a").write_text("old")
    (tmp_path / "link").symlink_to(tmp_path / "real" / "a")
    with new_output(tmp_path / "link", force=True) as partial:
        partial.write_text("new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real" / "a").read_text() == "new"


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError, SystemExit])
@pytest.mark.parametrize("folder", [True, False])
def test_whatever_is_raised_leaves_the_old(
    tmp_path: Path, error: type[BaseException], folder: bool
) -> None:
    (tmp_path / "a").write_text("old")
    before = listing(tmp_path)
    with pytest.raises(error), new_output(tmp_path / "a", force=True) as partial:
        if folder:
            write_folder(partial, "new")
        else:
            partial.write_text("new")
        raise error
    assert listing(tmp_path) == before


def test_a_move_that_fails_leaves_the_old_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_folder(tmp_path / "a", "old")
    before = listing(tmp_path)

    def failing(*_arguments: object) -> bool:
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(renaming, "_in_one_step", failing)
    with (
        pytest.raises(StorageError, match="the disk reports a fault"),
        new_output(tmp_path / "a", force=True, replaceable=lambda p: True) as partial,
    ):
        write_folder(partial, "new")
    assert listing(tmp_path) == before


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (errno.ENOSPC, "the disk is full: free space and run the command again"),
        (errno.EDQUOT, "quota"),
        (errno.EACCES, "permission"),
        (errno.EROFS, "read-only"),
        (errno.EIO, "fault"),
        (errno.EMFILE, "Too many open files"),
    ],
)
def test_a_fault_of_the_disk_is_a_sentence(tmp_path: Path, number: int, words: str) -> None:
    with (
        pytest.raises(StorageError, match=rf"out\.bin could not be written, .*{words}"),
        new_output(tmp_path / "out.bin") as partial,
    ):
        partial.write_bytes(b"x")
        raise OSError(number, os.strerror(number))
    assert listing(tmp_path) == {}


def fill_a_store(path: Path) -> None:
    with new_output(path, force=True) as partial:
        array = add_array(
            create_durable_store(partial, "nearfar test", 1), "a", (64, 65536), "u1", (1, 65536)
        )
        generator = np.random.default_rng(0)
        for i in range(64):
            array[i] = generator.integers(0, 255, 65536, dtype=np.uint8)


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(disk)]
    try:
        done = subprocess.run(mount, capture_output=True, check=False)
    except FileNotFoundError:
        pytest.skip("no mount here")
    if done.returncode:
        pytest.skip("a small tmpfs cannot be mounted here")
    yield disk
    subprocess.run(["umount", str(disk)], check=True)


def test_a_full_disk_is_a_sentence_and_leaves_the_old(small_disk: Path) -> None:
    create_store(small_disk / "a.zarr", "nearfar test", 1)
    before = listing(small_disk)
    with pytest.raises(StorageError, match=r"a\.zarr could not be written, the disk is full"):
        fill_a_store(small_disk / "a.zarr")
    image = np.random.default_rng(0).random((600, 600), dtype=np.float32)
    for ending in (".npy", ".tiff", ".exr"):
        with pytest.raises(StorageError, match="the disk is full"):
            write_picture(small_disk / f"b{ending}", image)
    assert listing(small_disk) == before


LIMITED = """
import resource, sys
from pathlib import Path
import numpy as np
from nearfar.errors import StorageError
from nearfar.files import new_output, renaming, write_picture
from nearfar.files.stores import add_array, create_store
folder = Path(sys.argv[1])
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
def store():
    with new_output(folder / "a.zarr") as partial:
        group = create_store(partial, "nearfar test", 1)
        array = add_array(group, "a", (9, 65536), "u1", (1, 65536))
        array[:] = np.random.default_rng(0).integers(0, 255, (9, 65536), dtype=np.uint8)
def picture():
    write_picture(folder / "a.exr", np.random.default_rng(0).random((99, 99)))
for write in (store, picture):
    try:
        write()
    except StorageError as error:
        print(error)
print(sorted(p.name for p in folder.iterdir()))
"""


def test_a_limit_on_files_is_a_sentence(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", LIMITED, str(tmp_path)], capture_output=True, text=True, check=True
    )
    store, picture, left = done.stdout.splitlines()
    assert "a.zarr could not be written, the file is larger" in store
    assert "a.exr could not be written, the file is larger" in picture
    assert left == "[]"


KILLED = """
import sys, time
from pathlib import Path
from nearfar.files import new_output
from nearfar.files.stores import add_array, create_durable_store
with new_output(Path(sys.argv[1]), force=True) as partial:
    group = create_durable_store(partial, "nearfar test", 2)
    array = add_array(group, "a", (9**9, 999), "u1", (1, 999))
    for i in range(9**9):
        array[i] = 1
        if i == 3:
            print("writing", flush=True)
"""


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGINT])
def test_a_killed_command_leaves_the_old(tmp_path: Path, how: signal.Signals) -> None:
    create_store(tmp_path / "a.zarr", "nearfar test", 1)
    before = listing(tmp_path)
    with subprocess.Popen(
        [sys.executable, "-c", KILLED, str(tmp_path / "a.zarr")],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    ) as command:
        assert command.stdout is not None
        command.stdout.readline()
        time.sleep(0.1)
        command.send_signal(how)
        with contextlib.suppress(subprocess.TimeoutExpired):
            command.wait(timeout=LONGEST_WAIT)
        command.kill()
    after = listing(tmp_path)
    if how is signal.SIGKILL:
        after = {name: data for name, data in after.items() if not name.startswith(".")}
    assert after == before
