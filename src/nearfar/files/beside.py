"""Hidden folders beside an output, in which it is made or the one before it stands aside.

Each is locked by the process that made it, for as long as that lives. What a killed command has
left is cleared by the next one that writes into the same folder.
"""

import contextlib
import hashlib
import os
import re
import secrets
import shutil
import sys
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from nearfar.files.locks import Lock, locked
from nearfar.files.renaming import rename_if_free

# Endings: what is being made or removed, and what stands aside while something takes its name.
PARTIAL, OLD = "partial", "old"

# Bytes of the output's name in that of the folder.
NAME_BYTES = 100


@contextlib.contextmanager
def hidden_folder(target: Path, what: str = PARTIAL) -> Iterator[Path]:
    """Yield a new empty folder beside `target`; remove it at the end with all that it holds.

    Parameters
    ----------
    target : Path
        The output.
    what : str
        `PARTIAL`; or `OLD`, from which what is still in it at the end is put back first, beside
        `target`, if its name is free, and kept in it otherwise.
    """
    while True:
        folder = target.with_name(_name(target, what))
        folder.mkdir()
        with locked(folder) as lock:
            # Another process may have taken it for a dead one's before it was locked.
            if lock is not Lock.ANOTHERS:
                try:
                    yield folder
                finally:
                    _dissolve(folder)
                return


def replace_in_two_steps(new: Path, target: Path) -> None:
    """Replace a file or folder where no system call does: it steps aside until the new one stands.

    Where that is stopped, what stands aside has its name again, now or when the next command
    writes there.
    """
    with hidden_folder(target, OLD) as folder:
        # By its number the new one is told from what somebody else gives the name meanwhile.
        aside = folder / f"{new.stat().st_ino}"
        aside.mkdir()
        target.rename(aside / target.name)
        rename_if_free(new, target)


def clear_dead(folder: Path) -> None:
    """Clear the hidden folders that killed commands have left in a folder.

    Only those of this machine and this user are cleared, and only where their lock tells that
    the process has gone.
    """
    pattern = re.compile(rf"\..*\.{_machine()}-[0-9a-f]{{8}}\.({PARTIAL}|{OLD})", re.DOTALL)
    try:
        found = [entry for entry in folder.iterdir() if pattern.fullmatch(entry.name)]
    except OSError:
        return
    for entry in found:
        with contextlib.suppress(OSError), locked(entry) as lock:
            if lock is Lock.OURS and _is_own(entry):
                _dissolve(entry, patient=False)


def discard(path: Path) -> None:
    """Remove a file or folder; whenever that is stopped, it is whole there, or not there."""
    # Where it cannot be renamed, on a disk that is full for one, it is removed all the same.
    with contextlib.suppress(OSError), hidden_folder(path) as folder:
        path.rename(folder / path.name)
    remove(path)


def remove(path: Path) -> None:
    """Remove a file or folder, if it is there."""
    # Another program may still be adding to the folder: try again.
    for _ in range(100):
        _remove(path)
        if not path.exists():
            return
        time.sleep(0.02)


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with contextlib.suppress(OSError):
            path.unlink(missing_ok=True)


def _dissolve(folder: Path, *, patient: bool = True) -> None:
    if folder.suffix == f".{OLD}":
        if not _put_back(folder):
            return
        # Renamed in one step, so that nothing half-removed is ever put back.
        folder = folder.rename(folder.with_suffix(f".{PARTIAL}"))
    (remove if patient else _remove)(folder)


def _put_back(folder: Path) -> bool:
    """Give what stands aside in a folder its name again; return whether nothing is left to keep."""
    try:
        for old in folder.glob("*/*"):
            target = folder.with_name(old.name)
            if not _is_number(target, old.parent.name):
                # By something empty a process takes a name that it then renames to.
                with contextlib.suppress(OSError):
                    target.rmdir()
                rename_if_free(old, target)
    except OSError:
        return False
    return True


def _is_number(path: Path, number: str) -> bool:
    return path.exists() and f"{path.stat().st_ino}" == number


def _name(target: Path, what: str) -> str:
    start = target.name.encode(errors="ignore")[:NAME_BYTES].decode(errors="ignore")
    return f".{start}.{_machine()}-{secrets.token_hex(4)}.{what}"


@cache
def _machine() -> str:
    # Without locks, as on Windows, nothing is cleared, and no machine need be told from another.
    name = os.uname().nodename if sys.platform != "win32" else ""
    return hashlib.sha256(name.encode(errors="ignore")).hexdigest()[:8]


def _is_own(folder: Path) -> bool:
    return sys.platform != "win32" and folder.stat().st_uid == os.geteuid()
