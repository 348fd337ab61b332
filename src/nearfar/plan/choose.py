"""The plan that is expected to relight best with a given number of photos.

It is of sinusoids (`nearfar.plan.choose_frequencies`), or, where the photos suffice, of all codes
(`nearfar.plan.by_codes`).
"""

from nearfar.arrays import AnySize, Size, as_size
from nearfar.callbacks import OldReport, Report, as_report, counting
from nearfar.checks import as_count, as_number
from nearfar.errors import PlanError
from nearfar.illumination.frequencies import Frequency, far_frequencies
from nearfar.plan.by_codes import plan_by_codes, suffice_for_codes
from nearfar.plan.checks import check_pairs, check_patterns, spread_checks
from nearfar.plan.choose_frequencies import (
    NOISE,
    choose_frequencies,
    purpose_of,
    references_among,
)
from nearfar.plan.codes import count_of_codes
from nearfar.plan.expect import Expected, expected_range
from nearfar.plan.model import LARGEST_SIDE, Plan
from nearfar.plan.paper import sinusoids
from nearfar.plan.patterns import Purpose
from nearfar.plan.references import FEWEST, with_references
from nearfar.plan.window import default_window, far_band, largest_window, pitch_of
from nearfar.priors.fitted import TYPICAL_SCENES
from nearfar.priors.typical import TypicalScenes

# Fewer photos than this settle neither q nor light.
FEWEST_PHOTOS = 24
SMALLEST_SIDE = 8
# Pixels and shorter side of the largest pattern grid all of whose frequencies are listed: more
# take minutes.
MOST_LISTED, LARGEST_LISTED_SIDE = 2**17, 128


def choose_plan(
    projector: AnySize,
    photos: int,
    *,
    window: int | None = None,
    typical: TypicalScenes | None = None,
    noise: float = NOISE,
    checks: int | None = None,
    every_frequency: bool = False,
    progress: Report | OldReport | None = None,
) -> tuple[Plan, Expected]:
    """Choose a plan of at most `photos` photos, whose own phase gives correspondence.

    Parameters
    ----------
    projector : Size
    photos : int
        All photos, whites, blacks and check photos included.
    window : int, optional
        W, an upper bound of how far near-range light reaches, in functions that stand `pitch_of`
        the projector apart; `default_window` if left out.
    typical : TypicalScenes
        Scenes to plan for: typical simulated ones, or, if given, the one of a first estimate.
    noise : float
        Standard deviation of the response to a sinusoid, as a share of white.
    checks : int, optional
        Check patterns, pictures and half-screens that no estimate sees; each is photographed with
        its inverse. By default about 4 % of the photos, and at least one pattern.
    every_frequency : bool
        Choose among all frequencies of the projector's DFT, the lowest first, as is best for scenes
        that are not direct, near-range and far-range light: `projector.pixels` + 5 photos show all
        of them.
    progress : callable, optional
        Called with what is being done and the share of it that is done, 0 to 1.

    Returns
    -------
    plan : Plan
    expected : Expected
        SNR_b expected of relighting the typical scenes; the ``expected_snr`` of the plan says how
        far others differ.

    Raises
    ------
    PlanError
        If the photos are too few or the projector too small.
    InputError
        If the size, the photos or W are not whole numbers, or the noise is not a number.

    Examples
    --------
    >>> chosen, expected = nearfar.choose_plan((8, 8), photos=24)
    >>> len(chosen.patterns)
    24
    """
    projector, photos = as_size(projector, "projector"), as_count(photos, "photos")
    window = None if window is None else as_count(window, "window")
    noise = as_number(noise, "noise")
    report = counting(as_report(progress, photos), "photos", photos)
    if photos < FEWEST_PHOTOS:
        raise PlanError(
            f"{photos} photos are too few to settle correspondence and light: plan with "
            f"`photos={FEWEST_PHOTOS}` or more."
        )
    sides = [side for side in projector if side > 1] or [1]
    if min(sides) < SMALLEST_SIDE or max(sides) > LARGEST_SIDE:
        raise PlanError(
            f"a projector of {projector} is no pattern grid to choose frequencies on: its sides "
            f"must be from {SMALLEST_SIDE} to {LARGEST_SIDE} pixels, or one of them 1."
        )
    if every_frequency and not can_list_every_frequency(projector):
        raise PlanError(
            f"a projector of {projector} has too many frequencies to list them all: plan for a "
            f"pattern grid of at most {MOST_LISTED} pixels, and {LARGEST_LISTED_SIDE} on the "
            f"shorter side."
        )
    checks = _checks(projector, photos, checks, every_frequency=every_frequency)
    by_codes = suffice_for_codes(projector, photos, checks, every_frequency=every_frequency)
    # Rows that photos of every frequency show need no model, and fit none of several pixels.
    is_whole = photos >= photos_of_every_frequency(projector)
    shows_all = every_frequency or by_codes or (is_whole and can_list_every_frequency(projector))
    pitch = 1 if shows_all else pitch_of(projector)
    window = default_window(projector, pitch) if window is None else window
    if not 1 <= window <= largest_window(projector, pitch):
        apart = "" if pitch == 1 else f" at a pitch of {pitch} projector pixels"
        raise PlanError(
            f"W = {window}{apart} does not fit a projector of {projector}: choose `window` "
            f"between 1 and {largest_window(projector, pitch)}."
        )
    own = photos - 2 * checks
    if own < FEWEST_PHOTOS - 2:
        raise PlanError(
            f"{checks} check patterns and their inverses leave too few of {photos} photos: plan "
            f"with `photos={FEWEST_PHOTOS + 2 * checks}` or more."
        )
    if by_codes:
        return plan_by_codes(
            projector,
            photos,
            window=window,
            checks=checks,
            typical=typical or TYPICAL_SCENES,
            noise=noise,
            is_looked_at=typical is not None,
        )
    choice = choose_frequencies(
        projector,
        own,
        window,
        references=references_among(photos, checks),
        pitch=pitch,
        typical=typical or TYPICAL_SCENES,
        noise=noise,
        every_frequency=every_frequency,
        progress=report,
    )
    band = far_band(projector)
    low = set(far_frequencies(band, projector))

    def purpose(frequency: Frequency) -> Purpose:
        if frequency in choice.of_direct:
            return "direct"
        return purpose_of(frequency, low)

    # Repeats stand far apart, so that no short disturbance meets them all.
    rounds = max(choice.frequencies.values())
    patterns = [
        pattern
        for repeat in range(rounds)
        for frequency, count in choice.frequencies.items()
        if repeat < count
        for pattern in sinusoids([frequency], purpose(frequency))
    ]
    plan = Plan(
        projector=projector,
        window=window,
        pitch=pitch,
        far=band,
        dropped=Size(1, 1),
        offset="reference",
        correspondence="phase",
        expected_snr=expected_range(choice.expected, pitch, is_looked_at=typical is not None),
        patterns=with_references(
            spread_checks(patterns, check_patterns(checks, projector)),
            choice.references,
            choice.references,
        ),
    )
    return plan, choice.expected


def _checks(projector: Size, photos: int, given: int | None, *, every_frequency: bool) -> int:
    """Return the number of check patterns, as given or by default.

    Where every frequency is asked for, they leave photos for all codes, or for all frequencies.
    """
    if given is not None:
        return as_count(given, "checks", 0)
    checks = check_pairs(photos)
    if not every_frequency:
        return checks
    for needed in (count_of_codes(projector) + 2 * FEWEST, photos_of_every_frequency(projector)):
        if photos - needed >= 2:
            return min(checks, int(photos - needed) // 2)
    return checks


def can_list_every_frequency(projector: Size) -> bool:
    """Return whether photos can be of all frequencies of a projector, the lowest first.

    Not on fine projectors: photos that end at a low frequency would tell neither q nor direct
    light, and those of every frequency are too many.
    """
    side = min(projector) if min(projector) > 1 else max(projector)
    return side <= LARGEST_LISTED_SIDE and projector.pixels <= MOST_LISTED


def photos_of_every_frequency(projector: Size) -> int:
    """Return how many photos show every frequency of a projector's DFT, without check photos."""
    return projector.pixels - 1 + 2 * FEWEST
