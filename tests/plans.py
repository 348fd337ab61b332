"""Plans that tests choose: each once in a process, for choosing takes as long as many tests."""

from functools import cache

from nearfar.arrays import Size
from nearfar.plan import Plan, choose_plan


@cache
def chosen_plan(
    projector: Size, photos: int, window: int | None = None, checks: int | None = None
) -> Plan:
    """Return a plan of so many photos; nothing changes a plan, so that tests share it."""
    return choose_plan(projector, photos, window=window, checks=checks)[0]
