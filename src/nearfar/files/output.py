"""Outputs that appear whole or not at all, and never over something else by accident."""

import contextlib
import errno
import os
import stat
from collections.abc import Callable, Iterator
from pathlib import Path

from nearfar.errors import (
    ExistingOutputError,
    InputError,
    MissingFileError,
    NearfarError,
    StorageError,
)
from nearfar.files.beside import clear_dead, discard, hidden_folder, replace_in_two_steps
from nearfar.files.kinds import kind_of_store
from nearfar.files.renaming import exchange, rename_if_free
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
    """Refuse, before any work, what `new_output` would refuse; same parameters and errors.

    A folder in which nothing can be written is refused, too.
    """
    require_writable(path, checked_target(path, force=force, replaceable=replaceable))


@contextlib.contextmanager
def new_output(
    path: Path, *, force: bool = False, replaceable: Callable[[Path], bool] = is_ours
) -> Iterator[Path]:
    """Yield a path in a hidden folder to write a file or a folder to; move it to `path` at the end.

    When the body ends well, what it wrote is synchronised to the disk and takes the place of
    `path` in one step; when it raises anything, interrupts too, what it wrote is removed and
    `path` is as before. What a killed process leaves is removed by the next that writes there.

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
        A path that does not exist yet, with the name of `path`.

    Raises
    ------
    ExistingOutputError, MissingFileError, InputError
        Before the body runs: if `path` exists and must not be replaced, or its folder is missing.
        After it: if `path` was made meanwhile by somebody else and must not be replaced.
    StorageError
        If the disk is full, read-only or closed to this user, in the body or after.
    """
    target = checked_target(path, force=force, replaceable=replaceable)
    with storage_faults(path), hidden_folder(target) as folder:
        partial = folder / target.name
        try:
            yield partial
            synchronise(partial)
            move_into_place(partial, target, path, force=force, replaceable=replaceable)
        except BaseException:
            abandon(partial)
            raise


def require_writable(path: Path, target: Path) -> None:
    """Raise a `StorageError` if an output `path` cannot be made beside and named as `target`."""
    with storage_faults(path), hidden_folder(target) as folder:
        (folder / target.name).touch()


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
        # Where links run in a circle, Path.resolve raises an error that is no OSError.
        target = Path(os.path.realpath(path))
        if not target.parent.is_dir():
            raise MissingFileError(
                f"{path} cannot be written, there is no folder {path.parent}: make it first."
            )
        # What a killed command let stand aside has its name again before anybody looks.
        clear_dead(target.parent)
        _require_replaceable(path, target, force=force, replaceable=replaceable)
    return target


def _require_replaceable(
    path: Path, target: Path, *, force: bool, replaceable: Callable[[Path], bool]
) -> None:
    try:
        mode = target.stat().st_mode
    except FileNotFoundError:
        return
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        raise InputError(
            f"{path} is neither a file nor a folder and is left alone: choose another name."
        )
    if not force:
        raise _is_there(path)
    if stat.S_ISDIR(mode) and not replaceable(target):
        raise ExistingOutputError(
            f"{path} is a folder that nearfar did not write, so `force=True` leaves it alone: "
            f"choose another name, or remove the folder yourself."
        )


def _is_there(path: Path) -> ExistingOutputError:
    return ExistingOutputError(f"{path} exists already: choose another name or add `force=True`.")


def move_into_place(
    new: Path,
    target: Path,
    path: Path,
    *,
    force: bool,
    replaceable: Callable[[Path], bool] = is_ours,
) -> None:
    """Give a file or folder the name of an output, and wait for the disk.

    What has the name by now is replaced only where `check_output` would allow it: another process
    may have taken it since that looked. At no moment is the name without the old or the new.

    Parameters
    ----------
    new : Path
        What was made, on the same disk.
    target : Path
        Where it goes, links followed.
    path : Path
        The same as the user gave it, for messages.
    force, replaceable
        As `new_output`.
    """
    while True:
        try:
            rename_if_free(new, target)
            break
        except FileExistsError:
            if not force:
                raise _is_there(path) from None
            _require_replaceable(path, target, force=force, replaceable=replaceable)
        # What had the name may have gone meanwhile: it is free then.
        with contextlib.suppress(FileNotFoundError):
            _replace(new, target)
            break
    synchronise_entry(target.parent)


def _replace(new: Path, target: Path) -> None:
    if not (new.is_dir() or target.is_dir()):
        new.replace(target)
    elif exchange(new, target):
        # It has the name of the new by now.
        discard(new)
    else:
        replace_in_two_steps(new, target)
