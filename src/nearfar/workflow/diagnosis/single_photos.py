"""Photos that do not fit the others, each explained by itself.

A photo that spoils an estimate hides in it, because the estimate bends to it. So photos with large
misfits are left out, and those of frequencies that all others foretell badly. The transport is
estimated again without them, and they are compared with its pictures: under their own pattern,
turned, under the patterns of other photos, in part under those, with other colours, or brighter or
darker. Photos that fit well though they were left out are taken back.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Floats
from nearfar.estimate.error_bars import ErrorBars
from nearfar.estimate.joint import means_of_blocks
from nearfar.faults.of_light import ExposureChanged
from nearfar.faults.of_photos import Spoilt
from nearfar.faults.of_single_photos import (
    ColoursSwapped,
    PhotosDark,
    PhotosMisfit,
    PhotosMixed,
    PhotosTorn,
    PhotosTurned,
    ShowsOtherPattern,
)
from nearfar.plan import Plan, Sinusoid
from nearfar.plan.checks import is_black
from nearfar.transport.model import Transport
from nearfar.workflow.diagnosis.explanations import (
    SUSPECT_MISFIT,
    TURNS,
    Explanation,
    explanations,
    exposure_change,
    simplest,
)
from nearfar.workflow.diagnosis.left_out import (
    HELD_OUT,
    estimate_without,
    photos_not_foretold,
)
from nearfar.workflow.diagnosis.misfit import (
    LEAST_IN_SUM,
    PhotoFits,
    fit_photos,
    is_white_or_black,
    relight,
    serves,
)

# Share of all photos that are left out at once, and at least so many.
LEFT_OUT_SHARE = 1 / 8
LEFT_OUT_AT_ONCE = 6
# Rounds of leaving out.
ROUNDS = 3
# Every frequency is left out in one of so many estimates.
TURNS_OF_LEAVING = 8
# A photo is explained by nothing known, yet spoilt, above this many times the misfit of the others
# that were left out with it.
UNEXPLAINED_RATIO = 40.0
# The square of its difference, over what noise and error bars expect, that spoils a photo where a
# block of camera pixels shows it.
LOCAL_SURPRISE = 10.0


# So many photos of one pattern that is not next to them are not of it.
MANY_OF_ONE = 3


class SpoiltPhotos(NamedTuple):
    """Photos that do not fit the others.

    Attributes
    ----------
    certain : list of Spoilt
        Photos that are of other patterns, turned, torn, or with other colours: they fit as that.
    probable : list of Spoilt
        Photos that are brighter or darker, mixed with the other phase of their frequency, or do not
        fit for no known reason. What spoils all photos may look like this as well.
    stand_out : bool
        Whether some are of frequencies that all others foretell badly, while the photos of most
        frequencies fit.
    """

    certain: list[Spoilt]
    probable: list[Spoilt]
    stand_out: bool


def find_spoilt_photos(fits: PhotoFits, known: Floats, *, suspected: bool | None) -> SpoiltPhotos:
    """Find photos that do not fit the others, and why.

    Parameters
    ----------
    fits : PhotoFits
        To the transport that was estimated from all photos.
    known : ndarray, shape (rows, columns, 2)
        q as it was found from all photos.
    suspected : bool or None
        Whether to search even if no photo has a large misfit, since the only photo of a frequency
        always fits the estimate. If False, large misfits of check photos are no reason to search.
    """
    plan = fits.plan
    fixed = is_white_or_black(plan) | serves(plan, "correspondence")
    good = np.ones(len(fixed), dtype=bool)
    explained: dict[int, Explanation | None] = {}
    reasons = good & ~fixed if suspected is None else good & ~fixed & ~serves(plan, "check")
    strange = photos_not_foretold(fits, good, known)
    if not suspected and not strange and not _suspects(fits.misfit, reasons):
        return SpoiltPhotos([], [], stand_out=False)
    stand_out = False
    for turn in range(ROUNDS):
        strange = strange if turn == 0 else photos_not_foretold(fits, good, known)
        suspects = _suspects(fits.misfit, good & ~fixed)
        suspects += [number for number in strange if number not in suspects and not fixed[number]]
        without = estimate_without(fits, good, suspects, known) if suspects else None
        if without is None:
            break
        found = _explain_all(fits, without, suspects, good, strange)
        stand_out |= any(number in found for number in strange)
        if not found:
            break
        explained |= found
        good[list(found)] = False
        again = estimate_without(fits, good, [], known)
        if again is None:
            break
        fits = fit_photos(fits.without_drift, again)
    if not plan.is_by_codes:
        explained |= _explain_by_turns(fits, good, explained, known)
    certain = certain_ones(plan, explained)
    probable = {n: e for n, e in explained.items() if n not in certain}
    return SpoiltPhotos(_as_faults(plan, certain), _as_faults(plan, probable), stand_out)


def certain_ones(
    plan: Plan, explained: Mapping[int, Explanation | None]
) -> dict[int, Explanation | None]:
    """Return the explanations that nothing else looks like.

    Exposure may be a response that is not linear. Cosine and sine mixed are the same pattern,
    shifted, as by a projector that moved, unless other photos are mixed too.

    Parameters
    ----------
    plan : Plan
    explained : mapping of int to Explanation or None
        By the number of the photo.
    """
    known = {n: e for n, e in explained.items() if e is not None and e.what != "exposure"}
    mixed = {n: e for n, e in known.items() if e.what == "mixed"}
    if all(e.other is not None and _are_phases(plan, n, e.other) for n, e in mixed.items()):
        known = {n: e for n, e in known.items() if n not in mixed}
    alike = _of_one_pattern(plan, known)
    return {n: e for n, e in known.items() if n not in alike}


def _of_one_pattern(plan: Plan, known: Mapping[int, Explanation]) -> set[int]:
    """Return many photos that look like one pattern, but could not have been taken of it.

    Out of focus, all fine patterns look alike. A projector that stands still shows the pattern
    before, or the one after, until it goes on.
    """
    photos_of: dict[int, list[int]] = {}
    for number, explanation in known.items():
        if explanation.what == "order" and explanation.other is not None:
            photos_of.setdefault(explanation.other, []).append(number)
    found: set[int] = set()
    for other, numbers in photos_of.items():
        is_run = np.ptp([*numbers, other]) == len(numbers)
        if len(numbers) >= MANY_OF_ONE and not is_run and not is_black(plan.patterns[other]):
            found |= set(numbers)
    return found


def _are_phases(plan: Plan, number: int, other: int) -> bool:
    """Return whether two photos are of one frequency, as cosine and sine are."""
    one, another = plan.patterns[number], plan.patterns[other]
    return (
        isinstance(one, Sinusoid)
        and isinstance(another, Sinusoid)
        and one.frequency == another.frequency
    )


def _suspects(misfit: Floats, tried: Booleans) -> list[int]:
    """Return the photos with the largest misfits of those that are tried, if they are unusual."""
    candidates = np.where(tried, misfit, 0.0)
    usual = max(1.0, float(np.median(misfit[tried])))
    most = max(LEFT_OUT_AT_ONCE, round(LEFT_OUT_SHARE * len(misfit)))
    return [
        int(n) for n in np.argsort(-candidates)[:most] if candidates[n] > SUSPECT_MISFIT * usual
    ]


def _explain_by_turns(
    fits: PhotoFits,
    good: Booleans,
    explained: dict[int, Explanation | None],
    known: Floats,
) -> dict[int, Explanation | None]:
    """Explain photos by pictures none of which was estimated from a photo of its own pattern.

    A photo in the place of another may hide, because no other photo tells of its frequency. It
    shows once it is left out, and the other fits it.
    """
    plan = fits.plan
    turns = np.zeros(len(good), dtype=np.int64)
    turn_of: dict[object, int] = {}
    for number, pattern in enumerate(plan.patterns):
        if isinstance(pattern, Sinusoid) and good[number]:
            turns[number] = turn_of.setdefault(pattern.frequency, len(turn_of) % TURNS_OF_LEAVING)
    relit = fits.relit.copy()
    measured = good & ~serves(plan, *HELD_OUT) & ~is_white_or_black(plan)
    for turn in range(TURNS_OF_LEAVING):
        left_out = np.flatnonzero(measured & (turns == turn)).tolist()
        without = estimate_without(fits, good, left_out, known) if left_out else None
        if without is not None:
            relit[left_out] = relight(plan, without, left_out)
    by_turns = replace(fits, relit=relit)
    found: dict[int, Explanation | None] = {}
    misfit = np.where(measured, by_turns.misfit, 0.0)
    open_photos = np.argsort(-misfit)[: LEFT_OUT_AT_ONCE * 2].tolist()
    open_photos += [number for number, explanation in explained.items() if explanation is None]
    while open_photos:
        number = open_photos.pop()
        best = simplest(list(explanations(by_turns, plan, number)))
        is_explained = best.explains(float(by_turns.misfit[number]))
        if number in found or not is_explained or _is_shared(by_turns, best, number, good):
            continue
        found[number] = best
        other = best.other
        # The other one may have its place in turn.
        if best.what == "order" and other is not None and explained.get(other) is None:
            open_photos.append(other)
    return found


def _is_shared(fits: PhotoFits, change: Explanation, number: int, good: Booleans) -> bool:
    """Return whether it is of exposure, and another good photo of the pattern shows it too.

    They were taken at different times: what both differ by is the error of the picture, which was
    estimated without either of them.
    """
    if change.what != "exposure":
        return False
    pattern, mine = fits.plan.patterns[number], np.array([change.gain, change.offset])
    for other in np.flatnonzero(good):
        if other != number and fits.plan.patterns[other] == pattern:
            theirs = exposure_change(fits, int(other))
            left = np.abs(mine - [theirs.gain, theirs.offset]).max()
            if left < LEAST_IN_SUM * np.abs(mine).max():
                return True
    return False


def _explain_all(
    all_fits: PhotoFits,
    without: Transport,
    suspects: list[int],
    good: Booleans,
    strange: list[int],
) -> dict[int, Explanation | None]:
    """Return the explanations of the suspects that are spoilt; None for those without one.

    Parameters
    ----------
    all_fits : PhotoFits
    without : Transport
        Estimated without the suspects.
    suspects : list of int
    good : ndarray of bool, shape (photos,)
        Photos that are not explained yet, suspects among them.
    strange : list of int
        Those suspects that all other photos foretell badly.
    """
    fits = fit_photos(all_fits.without_drift, without)
    own = {number: float(fits.misfit[number]) for number in suspects}
    usual = max(1.0, float(np.median(list(own.values()))))
    found: dict[int, Explanation | None] = {}
    surprises = []
    for number in suspects:
        if own[number] < SUSPECT_MISFIT:
            continue
        best = simplest(list(explanations(fits, fits.plan, number)))
        if best.explains(own[number]):
            if not _is_shared(fits, best, number, good):
                found[number] = best
        elif number in strange or own[number] > UNEXPLAINED_RATIO * usual:
            surprises.append(number)
    found |= dict.fromkeys((n for n in surprises if _surprises(fits, without, n)), None)
    return found


def _surprises(fits: PhotoFits, without: Transport, number: int) -> bool:
    """Return whether a photo differs by more than the error bars of its picture expect.

    Where no other photo tells of its pattern, it may well differ by far more than noise.
    """
    plan = fits.plan
    light = plan.draw(number) / np.float32(255)
    expected = ErrorBars(without).mean_squares(light).reshape(fits.white.shape)
    is_known = np.isfinite(expected)
    variance = fits.variance[number] + np.where(is_known, expected, np.inf)
    squares = (fits.photos[number] - fits.relit[number]) ** 2 / variance
    if float(squares.sum() / max(1, is_known.sum())) > SUSPECT_MISFIT:
        return True
    pixels, camera = is_known.all(axis=2).ravel(), without.camera
    of_blocks = means_of_blocks(squares.mean(axis=2).reshape(-1, 1), pixels, camera)
    return float(of_blocks.max(initial=0.0)) > LOCAL_SURPRISE


def _as_faults(plan: Plan, explained: Mapping[int, Explanation | None]) -> list[Spoilt]:
    """Join photos that are spoilt in the same way."""
    found: list[Spoilt] = []
    blacks = {number for number, pattern in enumerate(plan.patterns) if is_black(pattern)}
    dark = {n for n, e in explained.items() if e and e.what == "order" and e.other in blacks}
    if dark:
        found.append(PhotosDark(tuple(sorted(dark))))
        explained = {n: e for n, e in explained.items() if n not in dark}

    def photos(what: str, how: str = "") -> tuple[int, ...]:
        return tuple(
            sorted(
                n for n, e in explained.items() if e is not None and (e.what, e.how) == (what, how)
            )
        )

    def others(numbers: tuple[int, ...]) -> tuple[int, ...]:
        chosen = (explained[number] for number in numbers)
        return tuple(e.other for e in chosen if e is not None and e.other is not None)

    if numbers := photos("order"):
        found.append(ShowsOtherPattern(numbers, others(numbers)))
    for how, _ in TURNS:
        if numbers := photos("turned", how):
            found.append(PhotosTurned(numbers, how))
    found += [
        PhotosTorn(numbers, others(numbers), what == "interlaced")
        for what in ("torn", "interlaced")
        if (numbers := photos(what))
    ]
    if numbers := photos("mixed"):
        shares = [each.share for each in explained.values() if each is not None]
        found.append(PhotosMixed(numbers, others(numbers), max(shares)))
    if numbers := photos("colours"):
        found.append(ColoursSwapped(numbers))
    if numbers := photos("exposure"):
        changes = [e for e in explained.values() if e is not None and e.what == "exposure"]
        found.append(
            ExposureChanged(
                numbers,
                max((e.gain for e in changes), key=abs),
                max((e.offset for e in changes), key=abs),
            )
        )
    if numbers := tuple(sorted(n for n, e in explained.items() if e is None)):
        found.append(PhotosMisfit(numbers))
    return found
