"""Plans for the scene of a look: window, frequencies and kind of patterns by what was seen."""

from nearfar.arrays import Size
from nearfar.callbacks import Report
from nearfar.plan.choose import can_list_every_frequency, choose_plan
from nearfar.plan.expect import Expected
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

    It is of sinusoids, with a window that holds the near-range light that was seen, or of all
    frequencies, the lowest first, where direct, near-range and far-range light do not describe the
    scene, or where light has outlines on the projector and both pictures and a random light are
    expected to come out better so. With photos for all codes, it is of these, as without a look.

    Parameters
    ----------
    projector : Size
    photos : int
        All photos, whites, blacks and check photos included.
    look : Look
    window : int, optional
        W, by default the look's choice.
    checked : bool
        Whether there are check photos.
    progress : callable, optional
        Called with the step and the share of it that is done.

    Returns
    -------
    Plan

    Raises
    ------
    PlanError
        If the photos are too few or the projector too small.
    """
    chosen = look.wanted_window if look.model_holds else look.window

    def sinusoids(*, every_frequency: bool) -> tuple[Plan, Expected]:
        return choose_plan(
            projector,
            photos,
            window=chosen if window is None else window,
            typical=look.typical,
            noise=look.noise,
            checks=None if checked else 0,
            every_frequency=every_frequency,
            progress=progress,
        )

    can_list = can_list_every_frequency(projector)
    plan, expected = sinusoids(every_frequency=not look.model_holds and can_list)
    if look.model_holds and look.has_outlines and can_list:
        # A window's candidates skip frequencies at which outlines have light.
        of_every = sinusoids(every_frequency=True)
        if _is_better(of_every[1], expected):
            plan, expected = of_every
    return plan


def _is_better(one: Expected, other: Expected) -> bool:
    """Return whether both pictures and a random light are expected to come out better."""
    return all(a > b for a, b in zip(one, other, strict=True))
