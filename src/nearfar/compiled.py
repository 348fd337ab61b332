"""Loops over camera pixels, compiled at their first call, for what would be many passes in NumPy.

Compiled code is kept in a folder (Numba's: `__pycache__` or the user's cache), so that a machine
compiles a loop once, by one process at a time. Where no folder can be written to, each process
compiles for itself.
"""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, TypeVar

import numba
from numba.core.compiler_lock import global_compiler_lock

if sys.platform != "win32":
    import fcntl

Loop = TypeVar("Loop", bound=Callable[..., Any])

# Sums may be taken in another order, which vector instructions need; the order does not depend on
# threads. NaN and infinity keep their meaning.
FAST = {"reassoc", "contract", "arcp", "nsz"}

# Folders that this process has locked, as a loop may call another one.
_locked: set[str] = set()


def compiled(loop: Loop) -> Loop:
    """Compile a function of numbers and NumPy arrays, which then runs without the interpreter lock.

    It may call other compiled functions, and runs in the caller's thread.
    """
    made: Any
    try:
        made = numba.njit(loop, cache=True, nogil=True, fastmath=FAST, error_model="numpy")
    except RuntimeError:
        # Numba finds no folder to keep it in.
        made = numba.njit(loop, nogil=True, fastmath=FAST, error_model="numpy")
    else:
        made.compile = _alone_in(made.stats.cache_path, made.compile)
    kept: Loop = made
    return kept


def _alone_in(folder: str, compile_or_read: Callable[..., Any]) -> Callable[..., Any]:
    """Let no two processes compile loops that are kept in a folder, or read them meanwhile.

    The second one would compile what the first is about to keep. Numba also numbers the signatures
    of a loop: two that are kept at the same time may get the same number, and the code of one would
    be run for the other.
    """

    def alone(*arguments: Any) -> Any:
        # Numba's own lock first: it is held where one loop compiles another.
        with global_compiler_lock, _lock_of(folder):
            return compile_or_read(*arguments)

    return alone


@contextmanager
def _lock_of(folder: str) -> Iterator[None]:
    """Hold the lock of a folder, as far as the system and the file system have locks."""
    if folder in _locked or sys.platform == "win32":
        yield
        return
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    _locked.add(folder)
    try:
        with suppress(OSError):
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        _locked.remove(folder)
        os.close(descriptor)
