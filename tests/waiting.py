"""How tests wait for what must come."""

import time
from collections.abc import Callable

# Seconds after which it hangs, on the busiest machine too.
LONGEST_WAIT = 600.0


def wait_until(comes: Callable[[], object]) -> None:
    """Ask again and again until it comes."""
    end = time.monotonic() + LONGEST_WAIT
    while not comes():
        assert time.monotonic() < end, "it did not come"
        time.sleep(0.02)
