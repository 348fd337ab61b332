"""Show a plan's patterns on a rig and keep the photos."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from nearfar.arrays import AnyPath
from nearfar.capture import Capture, write_capture
from nearfar.errors import InputError
from nearfar.plan import Plan
from nearfar.rigs.base import Rig


def acquire(
    plan: Plan,
    path: AnyPath,
    rig: Rig,
    *,
    force: bool = False,
    progress: Callable[[int], None] | None = None,
    enough: Callable[[int, NDArray[Any]], bool] | None = None,
) -> Capture:
    """Shoot a plan.

    Parameters
    ----------
    plan : Plan
    path : str or Path
        Capture to make.
    rig : Rig
    force : bool
        Replace a capture that is there.
    progress : callable, optional
        Told the number of photos taken after each.
    enough : callable, optional
        Told each photo's number and the photo; where it says so, no more are taken.

    Returns
    -------
    Capture

    Raises
    ------
    PlanError
        If the plan's patterns are complex.
    InputError
        If the rig's projector is not the plan's.
    NearfarError
        As `nearfar.capture.write_capture`.
    """
    path = Path(path)
    plan.require_real("shoot")
    if rig.projector != plan.projector:
        raise InputError(
            f"the plan is for a projector of {plan.projector}, the rig has {rig.projector}: make "
            f"the plan with --projector {rig.projector}."
        )
    patterns = (plan.draw(i) for i in range(len(plan.patterns)))
    return write_capture(
        path,
        plan,
        rig.shoot(patterns),
        full_scale=rig.full_scale,
        rig=rig.describe(),
        force=force,
        progress=progress,
        enough=enough,
    )
