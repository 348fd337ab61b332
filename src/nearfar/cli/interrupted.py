"""The end of a command that is interrupted before it has begun anything.

This module imports next to nothing, so that the end can be told from the first moment on.
"""

import os

NOTHING_LEFT = "interrupted: nothing half-written was left behind."
# Of the signal that Ctrl-C sends: the module that knows it takes a while to import.
SIGINT = 2


def end(number: int) -> None:
    """Say that a signal came, and end the process at once with the status for it."""
    os.write(2, f"nearfar: {NOTHING_LEFT}\n".encode())
    os._exit(128 + number)
