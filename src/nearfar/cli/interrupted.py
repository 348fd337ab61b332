"""Exit of a command that is interrupted before it has begun anything.

This module imports next to nothing, so that interrupts are handled from the first moment on.
"""

import os

NOTHING_LEFT = "interrupted: nothing half-written was left behind."
# Number of the signal that Ctrl-C sends; the module `signal` takes a while to import.
SIGINT = 2


def end(number: int) -> None:
    """Print that the command was interrupted, and exit with status 128 + the signal's number."""
    os.write(2, f"nearfar: {NOTHING_LEFT}\n".encode())
    os._exit(128 + number)
