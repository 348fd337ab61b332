"""Renaming in one step that never replaces by accident, where the system has it."""

import contextlib
import ctypes
import errno
import os
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import NamedTuple

# What the system answers if it, or this file system, has no such step.
_NOT_HERE = {
    errno.ENOSYS,
    errno.EINVAL,
    errno.ENOTSUP,
    errno.EOPNOTSUPP,
    errno.EXDEV,
    # In a sandbox that does not know the call.
    errno.EPERM,
}
# AT_FDCWD of Linux: paths are relative to the current folder.
_CURRENT_FOLDER = -100


class _Step(NamedTuple):
    """The system's call that renames in one step, and its flags."""

    call: Callable[[bytes, bytes, int], int]
    no_replace: int
    exchange: int


def rename_if_free(source: Path, target: Path) -> None:
    """Rename a file or folder, unless the new name is taken.

    Where neither the system nor the file system can do so in one step, the new name is taken first
    by something empty, over which the file or folder is then renamed: of several processes that do
    so, one has the name. A program that writes into what is empty meanwhile is not seen if it is
    a file.

    Raises
    ------
    FileExistsError
        If the new name is taken, by an empty folder too.
    OSError
    """
    if os.name == "nt":
        # Windows refuses by itself.
        source.rename(target)
    elif not _in_one_step(source, target, "no_replace"):
        _take_and_rename(source, target)


def exchange(one: Path, other: Path) -> bool:
    """Give two files or folders each other's name in one step.

    Returns
    -------
    bool
        False, with everything as before, if the system or the file system cannot do so.

    Raises
    ------
    FileNotFoundError
        If one of them is not there.
    OSError
    """
    return _in_one_step(one, other, "exchange")


def _in_one_step(source: Path, target: Path, how: str) -> bool:
    step = _step()
    if step is None:
        return False
    if step.call(os.fsencode(source), os.fsencode(target), getattr(step, how)) == 0:
        return True
    number = ctypes.get_errno()
    if number in _NOT_HERE:
        return False
    raise OSError(number, os.strerror(number), str(source), None, str(target))


@cache
def _step() -> _Step | None:
    """Find the call of this system; none where there is none, such as in an old library."""
    if os.name == "nt":
        return None
    library = ctypes.CDLL(None, use_errno=True)
    if sys.platform == "darwin":
        with contextlib.suppress(AttributeError):
            return _Step(library.renamex_np, no_replace=4, exchange=2)
        return None
    with contextlib.suppress(AttributeError):
        rename = library.renameat2

        def call(source: bytes, target: bytes, flags: int) -> int:
            return int(rename(_CURRENT_FOLDER, source, _CURRENT_FOLDER, target, flags))

        return _Step(call, no_replace=1, exchange=2)
    return None


def _take_and_rename(source: Path, target: Path) -> None:
    if source.is_dir():
        target.mkdir()
        # A folder that is empty is replaced, and no other.
        _rename_over(source, target, target.rmdir)
        return
    try:
        os.link(source, target)
    except FileExistsError:
        raise
    except OSError:
        # A file system without hard links.
        target.touch(exist_ok=False)
        _rename_over(source, target, target.unlink)
    else:
        source.unlink()


def _rename_over(source: Path, taken: Path, give_up: Callable[[], None]) -> None:
    try:
        source.replace(taken)
    except BaseException:
        with contextlib.suppress(OSError):
            give_up()
        raise
