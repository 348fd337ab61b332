"""Plans for the scene of a look: window, frequencies and kind of patterns by what was seen."""

from nearfar.arrays import Size
from nearfar.callbacks import Report
from nearfar.plan.choose import can_list_every_frequency, choose_plan
from nearfar.plan.lamps import photos_of_every_code, plan_lamps
from nearfar.plan.look import Look
from nearfar.plan.model import Plan


def plan_by_look(
    projector: Size,
    photos: int,
    look: Look,
    *,
    window: int | None = None,
    checked: bool = True,
    progress: Report | None = None,
) -> Plan:
    """Choose the best plan of at most `photos` photos for the scene of a look.

    Where direct, near-range and far-range light describe the scene, it is of sinusoids, with a
    window that holds its near-range light. Where they do not, nothing is known of a row, and every
    projector pixel counts as a lamp of its own: codes of half of them, if there are photos for as
    many as tell all apart, and otherwise sinusoids of all frequencies, the lowest first. A code has
    twice the power of a sinusoid, so that codes tell rows with half the variance; too few of them
    leave out as much of a picture as of any other light.

    Parameters
    ----------
    projector : Size
    photos : int
        All photos, whites, blacks and check photos included.
    look : Look
    window : int, optional
        W, by default the look's choice. Plans with a given W are of sinusoids.
    checked : bool
        Whether there are check photos.
    progress : callable, optional
        Called with the step and the share of it that is done.

    Raises
    ------
    PlanError
        If the photos are too few or the projector too small.
    """
    if window is None and not look.model_holds:
        needed = photos_of_every_code(projector, checked=checked)
        if needed is not None and photos >= needed:
            return plan_lamps(projector, photos, checked=checked)
    if window is None:
        window = look.wanted_window if look.model_holds else look.window
    plan, _ = choose_plan(
        projector,
        photos,
        window=window,
        typical=look.typical,
        noise=look.noise,
        checks=None if checked else 0,
        every_frequency=not look.model_holds and can_list_every_frequency(projector),
        progress=progress,
    )
    return plan
