"""The plan that is expected to relight best with a given number of photos.

Starting from nothing, the pattern that lowers the expected errors under pictures and under a random
light most (`nearfar.plan.expect`) is added, again and again: a new frequency, or a frequency once
more. With as many photos as unknowns, every frequency is measured before any is repeated, whatever
scenes are expected to be.

At a pitch over 1 a share of the photos is of frequencies above those to choose from: they measure
direct light and its place, and the photos that they take do not grow with the projector either.

Index convention: k runs over candidate frequencies.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from nearfar.arrays import AnySize, Size, as_size
from nearfar.callbacks import OldReport, Report, as_report, counting
from nearfar.checks import as_count, as_number
from nearfar.errors import PlanError
from nearfar.illumination.frequencies import Frequency, far_frequencies, representatives
from nearfar.plan.candidates import candidates, finest_pattern, high_frequencies, lowest_first
from nearfar.plan.checks import check_pairs, check_patterns, spread_checks
from nearfar.plan.expect import (
    ErrorsTogether,
    Expected,
    ExpectedErrors,
    errors_of_all_measured,
    errors_of_none_measured,
    expected_of,
    expected_range,
)
from nearfar.plan.expect_place import errors_under_lights
from nearfar.plan.low_rank import ErrorsLowRank
from nearfar.plan.model import LARGEST_SIDE, Plan
from nearfar.plan.paper import sinusoids
from nearfar.plan.patterns import Purpose
from nearfar.plan.references import FEWEST, with_references
from nearfar.plan.window import default_window, largest_window, pitch_of
from nearfar.priors.fitted import TYPICAL_SCENES
from nearfar.priors.typical import TypicalScenes

# Standard deviation of the response to a sinusoid, as a share of white: 30 000 electrons at full
# scale and a scene of middling brightness.
NOISE = 0.011
# Fewer photos than this settle neither q nor light.
FEWEST_PHOTOS = 24
# f is kept at the measured ones of as many DFT frequencies on each side.
FAR_BAND_SIDE = 13
SMALLEST_SIDE = 8
# Pixels of the largest pattern grid all of whose frequencies are listed: more take minutes.
MOST_LISTED = 2**17
# Entries of a covariance times measurements up to which plans at a pitch of 1 are chosen by whole
# covariances: four seconds. Beyond, thin products choose others of the same worth, several times
# as fast.
MOST_WHOLE = 2.8e7
# Other photos from one white and black to the next. Fewer references leave more for frequencies
# but cost white light; at 117 photos of the box, 10 instead of 16 gain 0.6 dB under pictures and
# lose 0.7 dB under white.
REFERENCE_INTERVAL = 10
# How much a decibel under pictures and one under a random light count. At 1.5 for the latter,
# cornell-aside gains 0.9 dB under a random light at 117 photos, corner loses 0.8 dB under pictures
# at 261.
LIGHT_WEIGHTS = np.array([1.0, 1.2])


class FrequencyChoice(NamedTuple):
    """Frequencies and references to photograph.

    Attributes
    ----------
    frequencies : dict
        How often the photos of each frequency are taken, in the order of choice.
    of_direct : list of Frequency
        Those among them that are taken for direct light.
    references : int
        How often white and black are each photographed.
    expected : Expected
    """

    frequencies: dict[Frequency, int]
    of_direct: list[Frequency]
    references: int
    expected: Expected


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
            f"pattern grid of at most {MOST_LISTED} pixels whose windows are of single pixels."
        )
    pitch = pitch_of(projector)
    window = default_window(projector, pitch) if window is None else window
    if not 1 <= window <= largest_window(projector, pitch):
        apart = "" if pitch == 1 else f" at a pitch of {pitch} projector pixels"
        raise PlanError(
            f"W = {window}{apart} does not fit a projector of {projector}: choose `window` "
            f"between 1 and {largest_window(projector, pitch)}."
        )
    if checks is not None:
        checks = as_count(checks, "checks", 0)
    else:
        checks = check_pairs(photos)
        left_by_all = photos - photos_of_every_frequency(projector)
        if every_frequency and left_by_all >= 2:
            checks = min(checks, left_by_all // 2)
    own = photos - 2 * checks
    if own < FEWEST_PHOTOS - 2:
        raise PlanError(
            f"{checks} check patterns and their inverses leave too few of {photos} photos: plan "
            f"with `photos={FEWEST_PHOTOS + 2 * checks}` or more."
        )
    choice = choose_frequencies(
        projector,
        own,
        window,
        references=_references(photos, checks),
        pitch=pitch,
        typical=typical or TYPICAL_SCENES,
        noise=noise,
        every_frequency=every_frequency,
        progress=report,
    )
    band = Size(*(min(FAR_BAND_SIDE, side - 1 + side % 2) for side in projector))
    low = set(far_frequencies(band, projector))

    def purpose(frequency: Frequency) -> Purpose:
        if frequency in choice.of_direct:
            return "direct"
        return "far" if frequency in low or -frequency in low else "near"

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


def can_list_every_frequency(projector: Size) -> bool:
    """Return whether photos can be of all frequencies of a projector, the lowest first.

    Not where a window's functions are of several projector pixels: photos that end at a low
    frequency would tell neither q nor direct light, and those of every frequency are too many.
    """
    return pitch_of(projector) == 1 and projector.pixels <= MOST_LISTED


def photos_of_every_frequency(projector: Size) -> int:
    """Return how many photos show every frequency of a projector's DFT, without check photos."""
    return projector.pixels - 1 + 2 * FEWEST


def choose_frequencies(
    projector: Size,
    photos: int,
    window: int,
    *,
    references: int | None = None,
    pitch: int = 1,
    typical: TypicalScenes = TYPICAL_SCENES,
    noise: float = NOISE,
    every_frequency: bool = False,
    progress: Callable[[int], None] | None = None,
) -> FrequencyChoice:
    """Choose what to show with a given number of photos.

    Parameters
    ----------
    projector : Size
    photos : int
        Photos of transport and references together.
    window : int
        W.
    references : int, optional
        How often white and black are each photographed at most; by default as in a plan without
        check photos.
    pitch : int
        Projector pixels between the window's functions.
    typical : TypicalScenes
        Scenes to plan for.
    noise : float
        Standard deviation of a response, as a share of white.
    every_frequency : bool
        Show all frequencies of the DFT, the lowest first, as many as there are photos for.
    progress : callable, optional
        Called with the number of photos chosen so far.

    Returns
    -------
    FrequencyChoice
    """
    references = _references(photos, 0) if references is None else references
    start = _start(
        projector, photos, window, references, pitch, typical, noise, every=every_frequency
    )
    listed, errors, references = start.listed, start.errors, start.references
    cost = np.array([1 if k.is_own_negative else 2 for k in listed])
    left = photos - 2 * references
    chosen: dict[Frequency, int] = {}

    def take(place: int) -> None:
        nonlocal left
        chosen[listed[place]] = chosen.get(listed[place], 0) + 1
        left -= int(cost[place])

    for place in start.first:
        if cost[place] <= left:
            take(place)
            if not start.all_measured:
                errors.condition_on(place, noise)
    while left > 0:
        relative = errors.gains(noise) / errors.errors()[..., None]
        per_photo = typical.weights @ np.einsum("l,slk->sk", LIGHT_WEIGHTS, relative) / cost
        per_photo[cost > left] = -np.inf
        highest = per_photo.max()
        if not np.isfinite(highest):
            break
        best = int(np.argmax(per_photo >= highest * (1.0 - errors.rounding)))
        take(best)
        errors.condition_on(best, noise)
        if progress is not None:
            progress(photos - left)
    found = errors_under_lights(errors, chosen, projector, pitch, noise)
    expected = expected_of(found, errors.weights, references, typical, noise)
    return FrequencyChoice(chosen, start.of_direct, references, expected)


class _Start(NamedTuple):
    """What a choice starts from.

    Attributes
    ----------
    references : int
        How often white and black are each photographed.
    listed : list of Frequency
        What is chosen from.
    errors : ExpectedErrors
    first : list of int
        Which of them are taken before any is chosen, as many as there are photos for.
    of_direct : list of Frequency
        Those that are taken for direct light.
    all_measured : bool
        Whether the errors are those after `first` already.
    """

    references: int
    listed: list[Frequency]
    errors: ExpectedErrors
    first: Sequence[int]
    of_direct: list[Frequency]
    all_measured: bool = False


def _references(photos: int, checks: int) -> int:
    """Return how often white and black are each photographed, of so many photos in all.

    Check photos take the place of references, so that they cost no frequency: a pair of them that
    of a white and a black, as long as half of these are left.
    """
    found = photos // (REFERENCE_INTERVAL + 2)
    return max(FEWEST, found // 2, found - checks)


def _start(
    projector: Size,
    photos: int,
    window: int,
    references: int,
    pitch: int,
    typical: TypicalScenes,
    noise: float,
    *,
    every: bool,
) -> _Start:
    half = max(FEWEST, references // 2)
    # With as many photos as unknowns, nothing is left to what scenes are expected to be. For that,
    # half of the references are given up, or all but the fewest where no scene is expected.
    unknowns = projector.pixels - 1
    finest = finest_pattern(projector)
    if photos - 2 * (FEWEST if every else half) >= unknowns:
        references = min(references, (photos - unknowns) // 2)
        listed = lowest_first(projector)
        measured = errors_of_all_measured(listed, projector, window, pitch, typical, noise)
        return _Start(references, listed, measured, range(len(listed)), [finest], True)
    if every:
        listed = lowest_first(projector)
        unknown = errors_of_none_measured(listed, projector, window, pitch, typical)
        return _Start(half, listed, unknown, range(len(listed)), [finest])
    listed = candidates(projector, window, pitch)
    high = [finest] if pitch == 1 else high_frequencies(projector, pitch, photos)
    listed = representatives([*listed, *high])
    first = [listed.index(k) for k in high]
    left = photos - 2 * references
    if pitch == 1 and len(listed) ** 2 * (left / 2) <= MOST_WHOLE:
        together = ErrorsTogether(listed, projector, window, typical)
        return _Start(references, listed, together, first, high)
    # The checkerboard and its like are single photos.
    most = left if pitch == 1 else left // 2
    thin = ErrorsLowRank(listed, projector, window, pitch, typical, most)
    return _Start(references, listed, thin, first, high)
