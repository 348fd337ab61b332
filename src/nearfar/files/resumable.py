"""Outputs that take long: whatever stops them, what was written is kept and can be resumed."""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from nearfar.errors import ExistingOutputError, MissingFileError
from nearfar.files import output
from nearfar.files.output import checked_target, is_ours, remove, storage_faults, synchronise
from nearfar.files.writes import settle

if sys.platform != "win32":
    import fcntl

# Ending of a folder that is not finished.
UNFINISHED = ".unfinished"
# Endings of what stands in it before the store: logs, and files that are being written.
EARLY_ENTRIES = {".jsonl", ".partial"}


@contextmanager
def resumable_output(
    path: Path,
    is_worth_keeping: Callable[[Path, BaseException], bool],
    *,
    resume: bool = False,
    force: bool = False,
) -> Iterator[Path]:
    """Yield a folder beside `path` to write to, which is kept where the body does not end.

    When the body ends well the folder takes the place of `path`, as with `new_output`. Whatever
    stops it, kill -9 too, leaves the folder as it stands, to be resumed. While the body runs, the
    folder is locked against others.

    Parameters
    ----------
    path : Path
        Folder to make; a link is followed.
    is_worth_keeping : callable
        From the unfinished folder and the exception that stopped the body, returns whether the
        folder is worth keeping; otherwise it is removed.
    resume : bool
        Resume what is not finished.
    force : bool
        Replace what has the name already and, without `resume`, what was not finished.

    Yields
    ------
    Path
        A folder, `path` with ``.unfinished`` behind it, links followed.

    Raises
    ------
    MissingFileError
        If there is nothing to go on with.
    ExistingOutputError
        If there is something, and neither `resume` nor `force`; or if another process is at work on
        it.
    NearfarError
        As `new_output`.
    """
    target, unfinished = _checked(path, resume=resume, force=force)
    with storage_faults(path):
        unfinished.mkdir(exist_ok=resume or force)
        with _locked(unfinished):
            if not resume:
                _clear(unfinished)
            try:
                yield unfinished
                synchronise(unfinished)
                output.move_into_place(unfinished, target)
            except BaseException as error:
                settle()
                if unfinished.is_dir() and not is_worth_keeping(unfinished, error):
                    remove(unfinished)
                raise


def check_resumable(path: Path, *, resume: bool = False, force: bool = False) -> None:
    """Refuse, before any work, what `resumable_output` would refuse, in the same words."""
    _checked(path, resume=resume, force=force)


def _checked(path: Path, *, resume: bool, force: bool) -> tuple[Path, Path]:
    target = checked_target(path, force=force, replaceable=is_ours)
    unfinished = target.with_name(f"{target.name}{UNFINISHED}")
    if resume and not unfinished.is_dir():
        raise MissingFileError(
            f"{unfinished} is not there, so there is nothing to go on with: leave out "
            f"`resume=True`."
        )
    if not resume and unfinished.exists():
        if not force:
            raise ExistingOutputError(
                f"{unfinished} holds what was not finished: go on with it by `resume=True`, or "
                f"start anew with `force=True`."
            )
        checked_target(unfinished, force=True, replaceable=_is_unfinished)
    return target, unfinished


def _is_unfinished(folder: Path) -> bool:
    """Return whether a folder is ours, or held no more than a log when the process was killed."""
    return is_ours(folder) or all(entry.suffix in EARLY_ENTRIES for entry in folder.iterdir())


def _clear(folder: Path) -> None:
    for entry in folder.iterdir():
        remove(entry)


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Keep others from a folder that they would lock, too."""
    if sys.platform == "win32":
        yield
        return
    lock = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # Another process may have given the folder its final name meanwhile.
            alone = os.fstat(lock).st_ino == folder.stat().st_ino
        except (BlockingIOError, FileNotFoundError):
            alone = False
        if not alone:
            raise ExistingOutputError(
                f"another nearfar is at work on {folder}: wait for it, or end it first."
            )
        yield
    finally:
        os.close(lock)
