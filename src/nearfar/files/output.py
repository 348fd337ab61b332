"""Outputs that appear whole or not at all, and never over something else by accident."""

import contextlib
import errno
import os
import secrets
import shutil
import stat
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from nearfar.errors import (
    ExistingOutputError,
    InputError,
    MissingFileError,
    NearfarError,
    StorageError,
)
from nearfar.files.kinds import kind_of_store
from nearfar.files.writes import abandon

_CURES = {
    errno.ENOSPC: "the disk is full: free space and run the command again",
    errno.EDQUOT: "the disk quota is used up: free space and run the command again",
    errno.EFBIG: "the file is larger than the system allows: raise the limit, or write elsewhere",
    errno.EACCES: "there is no permission to write there: choose another folder",
    errno.EPERM: "there is no permission to write there: choose another folder",
    errno.EROFS: "the disk is read-only: choose another folder",
    errno.ENAMETOOLONG: "the name is too long: choose a shorter one",
    errno.EIO: "the disk reports a fault: check it, or write to another",
}


def is_ours(folder: Path) -> bool:
    """Return whether a folder may be replaced: it is empty, or a Zarr that nearfar wrote."""
    try:
        empty = not any(folder.iterdir())
    except OSError:
        return False
    return empty or (kind_of_store(folder) or "").startswith("nearfar ")


def check_output(
    path: Path, *, force: bool = False, replaceable: Callable[[Path], bool] = is_ours
) -> None:
    """Refuse, before any work, what `new_output` would refuse; same parameters and errors."""
    checked_target(path, force=force, replaceable=replaceable)


@contextlib.contextmanager
def new_output(
    path: Path, *, force: bool = False, replaceable: Callable[[Path], bool] = is_ours
) -> Iterator[Path]:
    """Yield a hidden path beside `path` to write a file or a folder to; move it there at the end.

    When the body ends well, what it wrote is synchronised to the disk and takes the place of
    `path` in one step; when it raises anything, interrupts too, what it wrote is removed and
    `path` is as before.

    Parameters
    ----------
    path : Path
        File or folder to make; a link is followed.
    force : bool
        Replace what is there.
    replaceable : callable
        Returns whether `force` may replace an existing folder, so that replacing ``~`` costs
        nobody their home. By default an empty folder or a Zarr of nearfar's.

    Yields
    ------
    Path
        A path that does not exist yet, with the ending of `path`.

    Raises
    ------
    ExistingOutputError, MissingFileError, InputError
        Before the body runs: if `path` exists and must not be replaced, or its folder is missing.
    StorageError
        If the disk is full, read-only or closed to this user, in the body or after.
    """
    target = checked_target(path, force=force, replaceable=replaceable)
    partial = _beside(target, "partial")
    try:
        with storage_faults(path):
            yield partial
            synchronise(partial)
            move_into_place(partial, target)
    except BaseException:
        abandon(partial)
        raise
    finally:
        remove(partial)


@contextlib.contextmanager
def storage_faults(path: Path) -> Iterator[None]:
    """Turn the system's faults while `path` is written into a `StorageError`.

    Faults that nearfar put into a sentence already pass.
    """
    try:
        yield
    except NearfarError:
        raise
    except OSError as error:
        reason = _CURES.get(error.errno or 0)
        if reason is None:
            reason = f"{error.strerror or error}: check the folder, or choose another"
        raise StorageError(f"{path} could not be written, {reason}.") from error


def synchronise(path: Path) -> None:
    """Wait until a file, or a folder with all that it holds, is on the disk."""
    if path.is_dir():
        for entry in path.iterdir():
            synchronise(entry)
    synchronise_entry(path)


def synchronise_entry(path: Path) -> None:
    """Wait until a file, or a folder's list of names, is on the disk."""
    if os.name != "posix" and path.is_dir():
        return
    descriptor = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def checked_target(path: Path, *, force: bool, replaceable: Callable[[Path], bool]) -> Path:
    """Return where an output goes, links followed; raises as `new_output` before its body."""
    with storage_faults(path):
        target = path.resolve()
        if not target.parent.is_dir():
            raise MissingFileError(
                f"{path} cannot be written, there is no folder {path.parent}: make it first."
            )
        try:
            mode = target.stat().st_mode
        except FileNotFoundError:
            return target
        if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
            raise InputError(
                f"{path} is neither a file nor a folder and is left alone: choose another name."
            )
        if not force:
            raise ExistingOutputError(
                f"{path} exists already: choose another name or add `force=True`."
            )
        if stat.S_ISDIR(mode) and not replaceable(target):
            raise ExistingOutputError(
                f"{path} is a folder that nearfar did not write, so `force=True` leaves it alone: "
                f"choose another name, or remove the folder yourself."
            )
    return target


def _beside(target: Path, what: str) -> Path:
    name = f".{target.stem[:60]}.{secrets.token_hex(4)}.{what}{target.suffix[:20]}"
    return target.with_name(name)


def move_into_place(partial: Path, target: Path) -> None:
    """Let a file or folder take the place of another, and wait for the disk."""
    if not target.is_dir() and not (target.exists() and partial.is_dir()):
        partial.replace(target)
    else:
        # The system replaces no full folder in one step: the old one steps aside until the new
        # one stands.
        old = _beside(target, "old")
        target.rename(old)
        try:
            partial.rename(target)
        except BaseException:
            old.rename(target)
            raise
        remove(old)
    synchronise_entry(target.parent)


def remove(path: Path) -> None:
    """Remove a file or folder, if it is there."""
    # Another program may still be adding to the folder: try again.
    for _ in range(100):
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            with contextlib.suppress(OSError):
                path.unlink(missing_ok=True)
        if not path.exists():
            return
        time.sleep(0.02)
