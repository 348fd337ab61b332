"""Waiting for what zarr still does after a fault.

zarr reads the chunks of an array side by side, in an event loop of its own, and a fault of one of
them leaves the others going. If the process ends meanwhile, Python complains of each.
"""

import asyncio

from zarr.core.sync import sync

# A disk that hangs does not hold up the fault for longer.
LONGEST_WAIT_SECONDS = 10.0


def settle() -> None:
    """Wait until zarr has finished what it began."""
    sync(_everything_else())


async def _everything_else() -> None:
    pending = asyncio.all_tasks() - {asyncio.current_task()}
    if pending:
        await asyncio.wait(pending, timeout=LONGEST_WAIT_SECONDS)
