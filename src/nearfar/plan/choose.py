"""The plan that is expected to relight best with a given number of photos.

Starting from nothing, the pattern that lowers the expected errors under pictures and under a random
light most (`nearfar.plan.expect`) is added, again and again: a new frequency, or a frequency once
more. With as many photos as unknowns, every frequency is measured before any is repeated, whatever
scenes are expected to be.

Index convention: k runs over candidate frequencies.
"""

from collections.abc import Callable
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from nearfar.arrays import AnySize, Size, as_size
from nearfar.callbacks import OldReport, Report, as_report, counting
from nearfar.checks import as_count, as_number
from nearfar.errors import PlanError
from nearfar.illumination.frequencies import (
    CHECKERBOARD,
    DC,
    Frequency,
    as_array,
    far_frequencies,
    grid,
    representatives,
    wrap,
)
from nearfar.plan.checks import check_pairs, check_patterns, spread_checks
from nearfar.plan.expect import (
    LOWEST_CYCLES,
    ErrorsTogether,
    Expected,
    ExpectedErrors,
    errors_of_all_measured,
    errors_of_none_measured,
    expected_of,
)
from nearfar.plan.model import LARGEST_SIDE, Plan
from nearfar.plan.paper import sinusoids
from nearfar.plan.patterns import Purpose
from nearfar.plan.references import FEWEST, with_references
from nearfar.plan.window import default_window, largest_window
from nearfar.priors.fitted import TYPICAL_SCENES
from nearfar.priors.typical import TypicalScenes

# Standard deviation of the response to a sinusoid, as a share of white: 30 000 electrons at full
# scale and a scene of middling brightness.
NOISE = 0.011
# Beyond LOWEST_CYCLES, one frequency in each of these shares of 1/W is a candidate: a window's
# spectrum changes no faster.
STEP_SHARE = 0.5
# Fewer photos than this settle neither q nor light.
FEWEST_PHOTOS = 24
# f is kept at the measured ones of as many DFT frequencies on each side.
FAR_BAND_SIDE = 13
SMALLEST_SIDE = 8
# Pixels of the largest pattern grid all of whose frequencies are listed: more take minutes.
MOST_LISTED = 2**17
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
    references : int
        How often white and black are each photographed.
    expected : Expected
    """

    frequencies: dict[Frequency, int]
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
        W, an upper bound of how far near-range light reaches; `default_window` if left out.
    typical : TypicalScenes
        What to plan for: the simulated scenes, or a quick first estimate of this one.
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
        What relighting is expected to reach on the typical scenes;
        `nearfar.plan.expect.expected_range` says how far others differ.

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
    if every_frequency and projector.pixels > MOST_LISTED:
        raise PlanError(
            f"a projector of {projector} has too many frequencies to list them all: plan for a "
            f"pattern grid of at most {MOST_LISTED} pixels."
        )
    window = default_window(projector) if window is None else window
    if not 1 <= window <= largest_window(projector):
        raise PlanError(
            f"W = {window} does not fit a projector of {projector}: choose `window` between 1 and "
            f"{largest_window(projector)}."
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
        typical=typical or TYPICAL_SCENES,
        noise=noise,
        every_frequency=every_frequency,
        progress=report,
    )
    band = Size(*(min(FAR_BAND_SIDE, side - 1 + side % 2) for side in projector))
    low = set(far_frequencies(band, projector))

    finest = finest_pattern(projector)

    def purpose(frequency: Frequency) -> Purpose:
        if frequency == finest:
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
        far=band,
        dropped=Size(1, 1),
        offset="reference",
        correspondence="phase",
        patterns=with_references(
            spread_checks(patterns, check_patterns(checks, projector)),
            choice.references,
            choice.references,
        ),
    )
    return plan, choice.expected


def photos_of_every_frequency(projector: Size) -> int:
    """Return how many photos show every frequency of a projector's DFT, without check photos."""
    return projector.pixels - 1 + 2 * FEWEST


def finest_pattern(projector: Size) -> Frequency:
    """Return the highest frequency: the checkerboard, or alternate pixels of one row or column."""
    return wrap(
        *(k if side > 1 else DC.fy for k, side in zip(CHECKERBOARD, projector, strict=True))
    )


def candidates(projector: Size, window: int) -> list[Frequency]:
    """Frequencies of the projector's DFT to choose from, one of each +-k, without DC."""
    low = Size(*(min(2 * LOWEST_CYCLES + 1, side) for side in projector))
    steps = round(window / STEP_SHARE)
    rounded = [
        wrap(*(_on_grid(part, side) for part, side in zip(k, projector, strict=True)))
        for k in grid(Size(steps, steps), Size(steps, steps))
    ]
    finest = finest_pattern(projector)
    halves = [finest, wrap(finest.fy, DC.fx), wrap(DC.fy, finest.fx)]
    even = all(side % 2 == 0 for side in projector)
    listed = far_frequencies(low, projector) + rounded + (halves if even else [finest])
    return [k for k in representatives(listed) if k != DC]


def _lowest_first(projector: Size) -> list[Frequency]:
    """All frequencies of the projector's DFT, one of each +-k, without DC, the lowest first."""
    listed = [k for k in representatives(grid(projector, projector)) if k != DC]
    cycles = np.linalg.norm(as_array(listed) * np.array(projector), axis=1)
    return [listed[i] for i in np.argsort(cycles, kind="stable")]


def _on_grid(part: Fraction, side: int) -> Fraction:
    return Fraction(round(part * side), side)


def choose_frequencies(
    projector: Size,
    photos: int,
    window: int,
    *,
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
    typical : TypicalScenes
        What to plan for.
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
    references = max(FEWEST, photos // (REFERENCE_INTERVAL + 2))
    half = max(FEWEST, references // 2)
    # With as many photos as unknowns, nothing is left to what scenes are expected to be. For that,
    # half of the references are given up, or all but the fewest where no scene is expected.
    unknowns = projector.pixels - 1
    is_complete = photos - 2 * (FEWEST if every_frequency else half) >= unknowns
    errors: ExpectedErrors
    if is_complete:
        references = min(references, (photos - unknowns) // 2)
        listed = _lowest_first(projector)
        errors = errors_of_all_measured(listed, projector, window, typical, noise)
    elif every_frequency:
        references = half
        listed = _lowest_first(projector)
        errors = errors_of_none_measured(listed, projector, window, typical)
    else:
        listed = candidates(projector, window)
        errors = ErrorsTogether(listed, projector, window, typical)
    cost = np.array([1 if k.is_own_negative else 2 for k in listed])
    left = photos - 2 * references
    chosen: dict[Frequency, int] = {}

    def take(place: int) -> None:
        nonlocal left
        chosen[listed[place]] = chosen.get(listed[place], 0) + 1
        left -= int(cost[place])

    if is_complete or every_frequency:
        for place in range(len(listed)):
            if cost[place] <= left:
                take(place)
                if not is_complete:
                    errors.condition_on(place, noise)
    else:
        finest = listed.index(finest_pattern(projector))
        take(finest)
        errors.condition_on(finest, noise)
    while left > 0:
        relative = errors.gains(noise) / errors.errors()[..., None]
        per_photo = typical.weights @ np.einsum("l,slk->sk", LIGHT_WEIGHTS, relative) / cost
        per_photo[cost > left] = -np.inf
        if not np.isfinite(per_photo.max()):
            break
        best = int(np.argmax(per_photo))
        take(best)
        errors.condition_on(best, noise)
        if progress is not None:
            progress(photos - left)
    expected = expected_of(errors, references, typical, noise)
    return FrequencyChoice(chosen, references, expected)
