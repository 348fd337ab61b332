"""Plans of all codes, for as many photos as there are projector pixels.

A sinusoid has half the power of a pattern of two levels, so that with photos for all codes of an
order, these tell the response to every frequency with half the variance. The photos that are left
are of the sinusoids that lower the expected errors most, as in `nearfar.plan.choose_frequencies`:
each with its inverse, so that the errors of white and black are in no response but that to DC.
"""

from collections.abc import Sequence
from copy import deepcopy
from operator import itemgetter

import numpy as np

from nearfar.arrays import Size
from nearfar.illumination.frequencies import Frequency, far_frequencies
from nearfar.plan.candidates import lowest_first
from nearfar.plan.checks import check_patterns, spread_checks
from nearfar.plan.choose_frequencies import (
    LIGHT_WEIGHTS,
    best_next,
    fewest_references,
    purpose_of,
    references_among,
)
from nearfar.plan.codes import code, count_of_codes, order_of_codes
from nearfar.plan.expect import (
    Expected,
    ExpectedErrors,
    errors_of_all_measured,
    expected_of,
    expected_range,
)
from nearfar.plan.model import Plan
from nearfar.plan.paper import sinusoids
from nearfar.plan.patterns import Pattern
from nearfar.plan.references import FEWEST, with_references
from nearfar.plan.window import far_band
from nearfar.priors.typical import TypicalScenes

# Variance of a response by all codes, and by a wave and its inverse, over that by a wave.
VARIANCE_SHARE = 0.5


def suffice_for_codes(
    projector: Size, photos: int, checks: int, *, every_frequency: bool = False
) -> bool:
    """Return whether photos suffice for all codes, and for white and black beside them.

    Parameters
    ----------
    projector : Size
    photos : int
        All photos.
    checks : int
        Check patterns, each with its inverse.
    every_frequency : bool
        Whether the fewest whites and blacks do, as no scene is expected.
    """
    references = FEWEST if every_frequency else fewest_references(photos, checks)
    return photos - 2 * checks - 2 * references >= count_of_codes(projector)


def plan_by_codes(
    projector: Size,
    photos: int,
    *,
    window: int,
    checks: int,
    typical: TypicalScenes,
    noise: float,
    is_looked_at: bool,
) -> tuple[Plan, Expected]:
    """Plan photos of all codes, as often as there are photos for, and of sinusoids with the rest.

    Parameters
    ----------
    projector : Size
    photos : int
        All photos, which suffice for all codes.
    window : int
        W of the estimate.
    checks : int
        Check patterns, each with its inverse.
    typical : TypicalScenes
        Scenes to plan sinusoids for.
    noise : float
        Standard deviation of the response to a sinusoid, as a share of white.
    is_looked_at : bool
        Whether these are of a look, and not typical.

    Returns
    -------
    plan : Plan
    expected : Expected
    """
    order = order_of_codes(projector.pixels)
    left = photos - 2 * checks
    fewest, most = (count(photos, checks) for count in (fewest_references, references_among))
    repeats = max(1, (left - 2 * fewest) // order)
    left -= repeats * order
    listed = lowest_first(projector)
    deviation = noise * VARIANCE_SHARE**0.5
    by_codes = errors_of_all_measured(
        listed, projector, window, 1, typical, deviation * repeats**-0.5
    )

    def rest(references: int) -> tuple[float, Expected, dict[Frequency, int]]:
        errors = deepcopy(by_codes)
        chosen = _choose_waves(listed, errors, left - 2 * references, deviation, typical)
        # The errors of white and black are in no response but that to DC.
        in_others = np.zeros((2, 1))
        expected = expected_of(errors.errors(), in_others, references, typical, noise)
        return float(LIGHT_WEIGHTS @ expected), expected, chosen

    # White and black cost sinusoids: as many as are worth it.
    counts = {min(count, left // 2) for count in (fewest, (fewest + most) // 2, most)}
    _, expected, chosen = max((rest(count) for count in sorted(counts)), key=itemgetter(0))
    waves = _waves_of(chosen, projector)
    # What is left over is of white and black.
    others = left - sum(map(len, waves))
    whites = others // 2
    shown: list[Pattern] = [code(number, order) for number in range(repeats * order)]
    plan = Plan(
        projector=projector,
        window=window,
        far=far_band(projector),
        dropped=Size(1, 1),
        offset="reference",
        correspondence="phase",
        expected_snr=expected_range(expected, is_looked_at=is_looked_at),
        patterns=with_references(
            spread_checks(_spread(waves, shown), check_patterns(checks, projector)),
            whites,
            others - whites,
        ),
    )
    return plan, expected


def _choose_waves(
    listed: list[Frequency],
    errors: ExpectedErrors,
    left: int,
    deviation: float,
    typical: TypicalScenes,
) -> dict[Frequency, int]:
    """Choose frequencies to photograph besides, and how often, and condition the errors on them."""
    # Projectors and cameras blur alternate pixels, which are their own negatives.
    cost = np.array([left + 1 if k.is_own_negative else 4 for k in listed])
    found: dict[Frequency, int] = {}
    while (best := best_next(errors, cost, left, deviation, typical)) is not None:
        found[listed[best]] = found.get(listed[best], 0) + 1
        errors.condition_on(best, deviation)
        left -= int(cost[best])
    return found


def _waves_of(chosen: dict[Frequency, int], projector: Size) -> list[list[Pattern]]:
    """Return a cosine with its sine, and their inverses, as often as chosen; repeats far apart."""
    far = set(far_frequencies(far_band(projector), projector))
    found: list[list[Pattern]] = []
    for repeat in range(max(chosen.values(), default=0)):
        pairs: list[list[Pattern]] = [
            list(sinusoids([frequency], purpose_of(frequency, far)))
            for frequency, count in chosen.items()
            if repeat < count
        ]
        found += pairs
        found += [[p.model_copy(update={"inverse": True}) for p in pair] for pair in pairs]
    return found


def _spread(groups: Sequence[Sequence[Pattern]], others: Sequence[Pattern]) -> list[Pattern]:
    """Return other patterns with groups of patterns evenly between them."""
    found: list[Pattern] = []
    done = 0
    for number, group in enumerate(groups):
        place = (2 * number + 1) * len(others) // (2 * len(groups))
        found += [*others[done:place], *group]
        done = place
    return [*found, *others[done:]]
