"""Outputs that take long: whatever stops them, what was written is kept and can be resumed."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from os.path import realpath
from pathlib import Path
from typing import NamedTuple

from nearfar.errors import ExistingOutputError, MissingFileError
from nearfar.files import output
from nearfar.files.beside import discard, remove
from nearfar.files.kinds import METADATA
from nearfar.files.locks import Lock, locked
from nearfar.files.output import (
    checked_target,
    is_ours,
    require_writable,
    storage_faults,
    synchronise,
    synchronise_entry,
)
from nearfar.files.writes import settle

# Ending of a folder that is not finished.
UNFINISHED = ".unfinished"
# Endings of what may stand in it before the store: logs, and files that are being written.
EARLY_ENTRIES = {".jsonl", ".partial"}


class ResumableKind(NamedTuple):
    """A kind of output that can be resumed.

    Attributes
    ----------
    log : str
        Name of a file in the unfinished folder, made before anything else there, in which it is
        noted what is on the disk.
    has_progress : callable
        From the unfinished folder, returns whether anything is noted that can be resumed. It may
        be asked while another process is at work there.
    """

    log: str
    has_progress: Callable[[Path], bool]


@contextmanager
def resumable_output(
    path: Path,
    kind: ResumableKind,
    is_worth_keeping: Callable[[Path, BaseException], bool],
    *,
    resume: bool = False,
    force: bool = False,
) -> Iterator[Path]:
    """Yield a folder beside `path` to write to, which is kept where the body does not end.

    When the body ends well the folder takes the place of `path`, as with `new_output`. Whatever
    stops it, kill -9 too, leaves the folder as it stands, to be resumed. While the body runs, the
    folder is locked against others.

    A folder in which nothing was noted before its process was killed is begun anew, with `resume`
    and without: the body finds an empty log in it.

    Parameters
    ----------
    path : Path
        Folder to make; a link is followed.
    kind : ResumableKind
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
        If there is something, and neither `resume` nor `force`; if it is not of this kind; or if
        another process is at work on it.
    NearfarError
        As `new_output`.
    """
    target, unfinished = _checked(path, kind, resume=resume, force=force)
    with storage_faults(path):
        unfinished.mkdir(exist_ok=True)
        with locked(unfinished) as lock:
            if lock is Lock.ANOTHERS:
                raise ExistingOutputError(
                    f"another nearfar is at work on {unfinished}: wait for it, or end it first."
                )
            # Once more: another process may have worked there until it was locked.
            _require_ours(unfinished, kind, resume=resume, force=force)
            _tidy(unfinished, kind, resume=resume)
            try:
                yield unfinished
                synchronise(unfinished)
                output.move_into_place(unfinished, target, path, force=force)
                # It was needed until now, for this to be resumed if its last step failed.
                (target / kind.log).unlink(missing_ok=True)
            except BaseException as error:
                settle()
                if unfinished.is_dir() and not is_worth_keeping(unfinished, error):
                    discard(unfinished)
                raise


def check_resumable(
    path: Path, kind: ResumableKind, *, resume: bool = False, force: bool = False
) -> None:
    """Refuse, before any work, what `resumable_output` would refuse, in the same words.

    A folder in which nothing can be written is refused, too.
    """
    target, unfinished = _checked(path, kind, resume=resume, force=force)
    for each in (target, unfinished):
        require_writable(path, each)


def _checked(path: Path, kind: ResumableKind, *, resume: bool, force: bool) -> tuple[Path, Path]:
    with storage_faults(path):
        _remove_log(Path(realpath(path)), kind)
    target = checked_target(path, force=force, replaceable=is_ours)
    unfinished = target.with_name(f"{target.name}{UNFINISHED}")
    with storage_faults(path):
        if unfinished.exists():
            _require_ours(unfinished, kind, resume=resume, force=force)
        elif resume:
            raise MissingFileError(
                f"{unfinished} is not there, so there is nothing to go on with: leave out "
                f"`resume=True`."
            )
    return target, unfinished


def _require_ours(folder: Path, kind: ResumableKind, *, resume: bool, force: bool) -> None:
    """Refuse an unfinished folder with which a command must not go on, or begin anew.

    One without the log is nothing that such a command has left, even if nearfar wrote it, as it
    wrote the copy of a capture.
    """
    has_log = (folder / kind.log).is_file()
    if not folder.is_dir() or (not has_log and any(folder.iterdir())):
        raise ExistingOutputError(
            f"{folder} is nothing that this command has left, it has no {kind.log}: choose another "
            f"name for the output, or move away what is there."
        )
    if resume or (not kind.has_progress(folder) and _is_begun(folder)):
        return
    if not force:
        raise ExistingOutputError(
            f"{folder} holds what was not finished: go on with it by `resume=True`, or start anew "
            f"with `force=True`."
        )
    checked_target(folder, force=True, replaceable=_is_begun)


def _is_begun(folder: Path) -> bool:
    """Return whether a folder is ours, or held no more than a log when the process was killed."""
    return is_ours(folder) or all(entry.suffix in EARLY_ENTRIES for entry in folder.iterdir())


def _remove_log(finished: Path, kind: ResumableKind) -> None:
    """Remove the log of a process that was killed when all was done but this."""
    if (finished / kind.log).is_file() and is_ours(finished):
        with locked(finished) as lock:
            if lock is Lock.OURS:
                (finished / kind.log).unlink(missing_ok=True)


def _tidy(folder: Path, kind: ResumableKind, *, resume: bool) -> None:
    """Remove what a killed process was writing; all of it, where nothing is to be resumed."""
    if resume and kind.has_progress(folder):
        for left in folder.rglob("*.partial"):
            left.unlink(missing_ok=True)
        return
    # The log first and the metadata last: the folder is known by them wherever this is stopped.
    log, metadata = folder / kind.log, folder / METADATA
    log.write_bytes(b"")
    for entry in {*folder.iterdir()} - {log, metadata}:
        remove(entry)
    remove(metadata)
    for each in (folder, folder.parent):
        synchronise_entry(each)
