"""Description of a plan."""

from collections import Counter

from nearfar.plan import Plan
from nearfar.plan.checks import is_reference
from nearfar.plan.choose import can_list_every_frequency, photos_of_every_frequency
from nearfar.plan.expected_range import ExpectedRange
from nearfar.plan.look import Look
from nearfar.plan.patterns import LampCode, Pattern
from nearfar.plan.recognition import summarise
from nearfar.plan.recognition.own import recognised_in
from nearfar.plan.window import largest_window

# Sorts of photos of a plan of codes, as they are counted.
SORTS = CODES, SINUSOIDS, TO_CHECK, WHITE_AND_BLACK = (
    "codes",
    "sinusoids with their inverses",
    "to check by",
    "white and black",
)


def describe_plan(plan: Plan) -> str:
    """Return a description of a plan, in lines: sizes, photos, and savings over brute force.

    Parameters
    ----------
    plan : Plan

    Returns
    -------
    str
    """
    if plan.offset == "shown":
        return "\n".join(
            [
                f"projector {plan.projector}, {len(plan.patterns)} pictures of somebody else's:",
                *summarise(recognised_in(plan)),
            ]
        )
    if plan.is_of_lamps:
        return _describe_lamps(plan)
    if plan.is_by_codes:
        return _describe_codes(plan)
    counts = ", ".join(f"{count} {purpose}" for purpose, count in plan.counts.items() if count)
    return "\n".join(
        [
            f"projector {plan.projector}, W = {plan.window}, far band {plan.far}, "
            f"near frequencies dropped {plan.dropped}, offset {plan.offset}",
            *([] if plan.pitch == 1 else [_describe_pitch(plan)]),
            f"{len(plan.patterns)} photos: {counts}",
            f"{_against(plan)}; counting the {plan.transport_photos} of transport alone, "
            f"{plan.savings:.2f} times fewer",
        ]
    )


def _describe_lamps(plan: Plan) -> str:
    """Describe a plan of codes of lamps."""
    lamps = plan.projector.pixels
    rows = {
        pattern.row
        for pattern in plan.patterns
        if isinstance(pattern, LampCode) and pattern.purpose == "direct"
    }
    tells = (
        "tell all of them apart" if len(rows) >= lamps else f"are {len(rows) / lamps:.0%} of them"
    )
    return "\n".join(
        [
            f"{lamps} lamps of {plan.projector}, in no order: codes of half of the lamps, which "
            f"{tells}",
            _describe_photos_of_codes(plan),
        ]
    )


def _describe_codes(plan: Plan) -> str:
    """Describe a plan of codes that measure all frequencies together."""
    return "\n".join(
        [
            f"projector {plan.projector}, W = {plan.window}, far band {plan.far}: codes of half of "
            f"the projector's pixels, which tell all of them apart with half the variance of "
            f"sinusoids",
            f"{_describe_photos_of_codes(plan)}; {_against(plan)}",
        ]
    )


def _describe_photos_of_codes(plan: Plan) -> str:
    counts = ", ".join(f"{count} {sort}" for sort, count in count_by_sort(plan).items())
    return f"{len(plan.patterns)} photos: {counts}"


def count_by_sort(plan: Plan) -> dict[str, int]:
    """Return how many photos of each sort a plan of codes has."""
    shown = Counter(_sort_of(pattern) for pattern in plan.patterns)
    return {sort: shown[sort] for sort in SORTS if shown[sort]}


def _sort_of(pattern: Pattern) -> str:
    """Return the sort of a pattern, as it is counted in a plan of codes."""
    if pattern.purpose == "check":
        return TO_CHECK
    if isinstance(pattern, LampCode):
        return CODES
    return WHITE_AND_BLACK if is_reference(pattern) else SINUSOIDS


def _describe_pitch(plan: Plan) -> str:
    """Describe the window of a plan at a pitch, and tell what plans of blocks are for."""
    side = largest_window(plan.projector)
    reach = plan.window // 2 * plan.pitch
    return (
        f"for every projector pixel: the window's functions are {plan.pitch} projector pixels "
        f"apart, and hold near-range light up to {reach} pixels from q, {reach / side:.0%} of the "
        f"screen's shorter side. In dim light, or from few photos, plan for blocks of pixels: a "
        f"smaller projector, whose patterns are enlarged for the screen"
    )


def describe_window(window: int, pitch: int) -> str:
    """Return the size of a window in a few words, such as "11 x 11 projector pixels"."""
    size = f"{window} x {window}"
    if pitch == 1:
        return f"{size} projector pixels"
    return f"{size} functions {pitch} projector pixels apart"


def describe_expected(expected: ExpectedRange, *, is_looked_at: bool) -> str:
    """Return a sentence on the expected SNR_b of relighting and the scenes that it holds for.

    Parameters
    ----------
    expected : ExpectedRange
    is_looked_at : bool
        Whether a first estimate of the scene gave the priors, and not typical scenes.
    """
    ranges = describe_range(expected)
    if is_looked_at:
        return f"expected of relighting this scene: {ranges}"
    return (
        f"expected of relighting scenes of direct, near-range and far-range light: {ranges}; "
        f"others, such as mirrors, glass and hair, come out worse, by 20 dB and more"
    )


def describe_range(expected: ExpectedRange) -> str:
    """Return the ranges of an expected SNR_b in words."""
    ranges = (expected.pictures, "pictures"), (expected.random, "a random light")
    return " and ".join(
        f"{low:.0f} to {high:.0f} dB under {light}" for (low, high), light in ranges
    )


def describe_look(look: Look, plan: Plan, photos_for_window: int | None) -> str:
    """Return a sentence on how a first estimate of the scene decided the window of a plan.

    Parameters
    ----------
    look : Look
    plan : Plan
    photos_for_window : int, optional
        Photos that leave as little unknown as a window of the look's size, if the plan's is larger.
    """
    if not look.model_holds:
        return _describe_no_model(look, plan)
    if look.reach is None:
        return f"the look shows hardly any near-range light: planned with W = {plan.window}"
    more = " or more" if look.reach >= look.window else ""
    reach = look.reach * plan.pitch
    falls = f"near-range light falls by a factor e in {reach:.1f}{more} projector pixels"
    if photos_for_window is None:
        return f"{falls} in the look: planned with W = {plan.window}"
    wanted = ", as asked"
    if look.wanted_window > look.window:
        falls += f", and reaches further than the look's W = {look.window}"
        wanted = "" if plan.window == look.wanted_window else wanted
    return (
        f"{falls}: planned with W = {plan.window}{wanted}, for which about {photos_for_window} "
        f"photos leave as little unknown as {len(plan.patterns)} for W = {look.window}"
    )


def _describe_no_model(look: Look, plan: Plan) -> str:
    """Describe a plan for a scene that no model describes."""
    found = (
        f"the scene is not direct, near-range and far-range light alone: by its light, "
        f"{look.free_share:.0%} of the look's camera pixels fit no window and no band"
    )
    if not can_list_every_frequency(plan.projector):
        return f"{found}. The projector has too many frequencies to do without them"
    if plan.transport_photos >= plan.projector.pixels:
        return f"{found}. Planned without them: all frequencies are shown"
    needed = photos_of_every_frequency(plan.projector)
    return (
        f"{found}. Planned without them: the lowest frequencies are shown; {needed} photos and "
        f"the check photos show all"
    )


def _against(plan: Plan) -> str:
    """Compare all photos with those of brute force."""
    photos, brute_force = len(plan.patterns), plan.projector.pixels
    if photos > brute_force:
        return f"{photos / brute_force:.2f} times more than the {brute_force} of brute force"
    return f"{brute_force / photos:.2f} times fewer than the {brute_force} of brute force"
