"""Locks on folders, which end with the process that holds them."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from enum import Enum, auto
from pathlib import Path

if sys.platform != "win32":
    import fcntl


class Lock(Enum):
    """Who has the lock of a folder.

    It is unknown where the system or the file system has no locks: Windows, some network drives.
    """

    OURS = auto()
    ANOTHERS = auto()
    UNKNOWN = auto()


@contextmanager
def locked(folder: Path) -> Iterator[Lock]:
    """Lock a folder, if no other process has; who has the lock while the body runs is yielded.

    A folder that has gone, or that was renamed meanwhile, is another's.

    Raises
    ------
    OSError
        If the folder may not be read.
    """
    if sys.platform == "win32":
        yield Lock.UNKNOWN
        return
    try:
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    except FileNotFoundError:
        yield Lock.ANOTHERS
        return
    try:
        yield _locked(descriptor, folder)
    finally:
        os.close(descriptor)


def _locked(descriptor: int, folder: Path) -> Lock:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return Lock.ANOTHERS
    except OSError:
        return Lock.UNKNOWN
    try:
        # Another process may have given the folder another name, or removed it, meanwhile.
        same = os.path.samestat(os.fstat(descriptor), folder.stat())
    except FileNotFoundError:
        same = False
    return Lock.OURS if same else Lock.ANOTHERS
