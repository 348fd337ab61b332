"""Loops over camera pixels, compiled at their first call, for what would be many passes in NumPy.

Compiled code is kept in a folder (Numba's: `__pycache__` or the user's cache), so that a machine
compiles a loop once. Where no folder can be written to, each process compiles for itself.
"""

from collections.abc import Callable
from typing import Any, TypeVar

import numba

Loop = TypeVar("Loop", bound=Callable[..., Any])

# Sums may be taken in another order, which vector instructions need; the order does not depend on
# threads. NaN and infinity keep their meaning.
FAST = {"reassoc", "contract", "arcp", "nsz"}


def compiled(loop: Loop) -> Loop:
    """Compile a function of numbers and NumPy arrays, which then runs without the interpreter lock.

    It may call other compiled functions, and runs in the caller's thread.
    """
    made: Loop
    try:
        made = numba.njit(loop, cache=True, nogil=True, fastmath=FAST, error_model="numpy")
    except RuntimeError:
        # Numba finds no folder to keep it in.
        made = numba.njit(loop, nogil=True, fastmath=FAST, error_model="numpy")
    return made
