"""The frequencies that are expected to relight best with a given number of photos.

Starting from nothing, the pattern that lowers the expected errors under pictures and under a random
light most (`nearfar.plan.expect`) is added, again and again: a new frequency, or a frequency once
more. With as many photos as unknowns, every frequency is measured before any is repeated, whatever
scenes are expected to be.

At a pitch over 1 a share of the photos is of frequencies above those to choose from: they measure
direct light and its place, and the photos that they take do not grow with the projector either.

Index convention: k runs over candidate frequencies.
"""

from collections.abc import Callable, Sequence, Set
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Integers, Size
from nearfar.illumination.frequencies import Frequency, representatives
from nearfar.plan.candidates import candidates, finest_pattern, high_frequencies, lowest_first
from nearfar.plan.expect import (
    ErrorsTogether,
    Expected,
    ExpectedErrors,
    errors_of_all_measured,
    errors_of_none_measured,
    expected_of,
)
from nearfar.plan.expect_place import errors_under_lights
from nearfar.plan.low_rank import ErrorsLowRank
from nearfar.plan.patterns import Purpose
from nearfar.plan.references import FEWEST
from nearfar.priors.fitted import TYPICAL_SCENES
from nearfar.priors.typical import TypicalScenes

# Standard deviation of the response to a sinusoid, as a share of white: 30 000 electrons at full
# scale and a scene of middling brightness.
NOISE = 0.011
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
    references = references_among(photos, 0) if references is None else references
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
    while (best := best_next(errors, cost, left, noise, typical)) is not None:
        take(best)
        errors.condition_on(best, noise)
        if progress is not None:
            progress(photos - left)
    found = errors_under_lights(errors, chosen, projector, pitch, noise)
    expected = expected_of(found, errors.weights, references, typical, noise)
    return FrequencyChoice(chosen, start.of_direct, references, expected)


def best_next(
    errors: ExpectedErrors, cost: Integers, left: int, noise: float, typical: TypicalScenes
) -> int | None:
    """Return the candidate that lowers the errors most for its photos.

    Parameters
    ----------
    errors : ExpectedErrors
    cost : ndarray of int, shape (K,)
        Photos of each candidate.
    left : int
        Photos that are left.
    noise : float
        Standard deviation of the response to a candidate, as a share of white.
    typical : TypicalScenes

    Returns
    -------
    int or None
        None if no candidate has so few photos as are left.
    """
    if left < cost.min():
        return None
    relative = errors.gains(noise) / errors.errors()[..., None]
    per_photo = typical.weights @ np.einsum("l,slk->sk", LIGHT_WEIGHTS, relative) / cost
    per_photo[cost > left] = -np.inf
    return int(np.argmax(per_photo >= per_photo.max() * (1.0 - errors.rounding)))


def purpose_of(frequency: Frequency, far: Set[Frequency]) -> Purpose:
    """Return the purpose of a frequency's photos: far if it is in the far band, otherwise near."""
    return "far" if frequency in far or -frequency in far else "near"


def fewest_references(photos: int, checks: int) -> int:
    """Return how often white and black are each photographed at least where all else is shown."""
    return max(FEWEST, references_among(photos, checks) // 2)


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


def references_among(photos: int, checks: int) -> int:
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
