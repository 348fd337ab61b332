"""The virtual GigE Vision cameras of the loopback, which every process of this machine finds."""

import fcntl
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def alone_on_the_loopback() -> Iterator[None]:
    """Wait until no other process's tests have a camera there: some take the first they find."""
    with (Path(tempfile.gettempdir()) / "nearfar-tests-of-cameras.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield
