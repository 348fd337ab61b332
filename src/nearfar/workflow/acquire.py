"""Show a plan's patterns on a rig and keep the photos, on the disk or in memory."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import AnyPath
from nearfar.capture import Capture, write_capture
from nearfar.errors import InputError
from nearfar.photometry.held import HeldPhotos
from nearfar.plan import Plan
from nearfar.rigs.base import Photo, Rig


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
    return write_capture(
        path,
        plan,
        _photos(plan, rig),
        full_scale=rig.full_scale,
        rig=rig.describe(),
        force=force,
        progress=progress,
        enough=enough,
    )


def hold(plan: Plan, rig: Rig) -> HeldPhotos:
    """Shoot a plan and hold its photos in memory: for simulations.

    Raises
    ------
    PlanError, InputError
        As `acquire`.
    """
    return HeldPhotos(plan, np.stack(list(_photos(plan, rig))), rig.full_scale)


def _photos(plan: Plan, rig: Rig) -> Iterator[Photo]:
    plan.require_real("shoot")
    if rig.projector != plan.projector:
        raise InputError(
            f"the plan is for a projector of {plan.projector}, the rig has {rig.projector}: make "
            f"the plan with --projector {rig.projector}."
        )
    return rig.shoot(plan.draw(i) for i in range(len(plan.patterns)))
