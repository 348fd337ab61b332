"""Plans for the scene of a look: window, frequencies and kind of patterns by what was seen."""

from nearfar.arrays import Size
from nearfar.callbacks import Report
from nearfar.plan.choose import can_list_every_frequency, choose_plan
from nearfar.plan.expect import Expected, expected_of_codes, expected_range
from nearfar.plan.lamps import photos_of_every_code, plan_lamps, shares_of_photos
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
    expected to come out better so. With photos
    for as many codes as tell all projector pixels apart, it is of these codes if they are expected
    to relight better: both under pictures and under a random light. They tell rows with half the
    variance of sinusoids, but without what is known of a row before any photo.

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

    Returns
    -------
    Plan
        `Plan.is_of_lamps` if it is of codes: `nearfar.workflow.free_rows` makes a transport of its
        photos.

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
    of_codes = None if window is not None else _expected_of_codes(projector, photos, look, checked)
    if of_codes is None or not _is_better(of_codes, expected):
        return plan
    found = expected_range(of_codes, is_looked_at=True)
    codes = plan_lamps(projector, photos, checked=checked)
    return codes.model_copy(update={"expected_snr": found})


def _is_better(one: Expected, other: Expected) -> bool:
    """Return whether both pictures and a random light are expected to come out better."""
    return all(a > b for a, b in zip(one, other, strict=True))


def _expected_of_codes(projector: Size, photos: int, look: Look, checked: bool) -> Expected | None:
    """Return the expected SNR_b of codes; None if the photos do not suffice for all of them."""
    needed = photos_of_every_code(projector, checked=checked)
    if needed is None or photos < needed:
        return None
    references, _, codes = shares_of_photos(projector, photos, checked=checked)
    return expected_of_codes(projector, codes, references, look.noise)
