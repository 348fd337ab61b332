"""Photos that do not fit the others, each explained by itself.

A photo that spoils an estimate hides in it, because the estimate bends to it. So photos with large
misfits are left out, the transport is estimated again without them, and they are compared with its
pictures: under their own pattern, turned, under the patterns of other photos, in part under those,
with other colours, or brighter or darker. Photos that fit well though they were left out are taken
back.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import permutations
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Floats
from nearfar.correspondence import correspond_by_phase
from nearfar.errors import InputError
from nearfar.estimate.error_bars import ErrorBars
from nearfar.estimate.joint import estimate_jointly
from nearfar.faults.of_photos import (
    ColoursSwapped,
    ExposureChanged,
    PhotosMisfit,
    PhotosTorn,
    PhotosTurned,
    ShowsOtherPattern,
    Spoilt,
)
from nearfar.photometry.by_inverse import find_pairs
from nearfar.photometry.measure import measure
from nearfar.plan import Plan, Sinusoid
from nearfar.transport.model import Transport
from nearfar.workflow.diagnosis.misfit import (
    LEAST_IN_SUM,
    SMALLEST_CHANGE,
    PhotoFits,
    fit_photos,
    is_white_or_black,
    mean_white,
    relight,
    serves,
)

# A photo is suspect above this misfit, in multiples of the usual one, which is at least 1.
SUSPECT_MISFIT = 4.0
# Share of all photos that are left out at once, and at least so many.
LEFT_OUT_SHARE = 1 / 8
LEFT_OUT_AT_ONCE = 6
# Rounds of leaving out.
ROUNDS = 3
# Every frequency is left out in one of so many estimates.
TURNS_OF_LEAVING = 8
# An explanation leaves at most this share of the misfit: by exposure, and by anything else.
EXPOSURE_SHARE = 0.4
OTHER_SHARE = 0.1
# An explanation that leaves at most this many times the misfit of the best is as good, if simpler.
AS_GOOD = 1.3
# A photo is explained by nothing known, yet spoilt, above this many times the misfit of the others
# that were left out with it.
UNEXPLAINED_RATIO = 40.0
# The pattern of a photo so many places away may show in part of another.
TORN_REACH = 3
# Photos of these purposes are not estimated from.
HELD_OUT = ("check", "correspondence")
# Sweeps of the estimate.
SWEEPS = 2

TURNS: tuple[tuple[str, Callable[[Floats], Floats]], ...] = (
    ("rotated by 180 degrees", lambda picture: picture[::-1, ::-1]),
    ("mirrored left to right", lambda picture: picture[:, ::-1]),
    ("mirrored top to bottom", lambda picture: picture[::-1]),
)


@dataclass(frozen=True)
class Explanation:
    """A hypothesis on how a photo was spoilt, and the misfit that it leaves.

    Attributes
    ----------
    what : str
        "order", "turned", "torn", "interlaced", "colours" or "exposure".
    misfit : float
    other : int or None
        Number of the other photo that it is like.
    how : str
        How it is turned.
    gain, offset : float
        Changes of lamp or exposure, and of ambient light.
    """

    what: str
    misfit: float
    other: int | None = None
    how: str = ""
    gain: float = 0.0
    offset: float = 0.0

    def explains(self, misfit: float) -> bool:
        """Return whether it explains a photo whose misfit is so large without it."""
        most = EXPOSURE_SHARE if self.what == "exposure" else OTHER_SHARE
        return misfit >= SUSPECT_MISFIT and self.misfit < most * misfit


class SpoiltPhotos(NamedTuple):
    """Photos that do not fit the others.

    Attributes
    ----------
    certain : list of Spoilt
        Photos that are of other patterns, turned, torn, or with other colours: they fit as that.
    probable : list of Spoilt
        Photos that are brighter or darker, or do not fit for no known reason. What spoils all
        photos may look like this as well.
    """

    certain: list[Spoilt]
    probable: list[Spoilt]


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
    if not suspected and not _suspects(fits.misfit, reasons):
        return SpoiltPhotos([], [])
    for _ in range(ROUNDS):
        suspects = _suspects(fits.misfit, good & ~fixed)
        without = _estimate_without(fits, good, suspects, known) if suspects else None
        found = _explain_all(fits, without, suspects, good) if without is not None else {}
        if not found:
            break
        explained |= found
        good[list(found)] = False
        again = _estimate_without(fits, good, [], known)
        if again is None:
            break
        fits = fit_photos(fits.without_drift, again)
    explained |= _explain_by_turns(fits, good, explained, known)
    certain = {n: e for n, e in explained.items() if e is not None and e.what != "exposure"}
    probable = {n: e for n, e in explained.items() if n not in certain}
    return SpoiltPhotos(_as_faults(certain), _as_faults(probable))


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
        without = _estimate_without(fits, good, left_out, known) if left_out else None
        if without is not None:
            relit[left_out] = relight(plan, without, left_out)
    by_turns = replace(fits, relit=relit)
    found: dict[int, Explanation | None] = {}
    misfit = np.where(measured, by_turns.misfit, 0.0)
    open_photos = np.argsort(-misfit)[: LEFT_OUT_AT_ONCE * 2].tolist()
    open_photos += [number for number, explanation in explained.items() if explanation is None]
    while open_photos:
        number = open_photos.pop()
        best = _simplest(list(_explanations(by_turns, plan, number)))
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


def _estimate_without(
    fits: PhotoFits, good: Booleans, left_out: list[int], known: Floats
) -> Transport | None:
    """Estimate the transport without some photos; None if too few remain."""
    plan = fits.plan
    keep = good & ~serves(plan, *HELD_OUT)
    keep[left_out] = False
    # A photo is nothing without its inverse, where all come in pairs; a cosine without its sine.
    for pair in find_pairs(plan) if plan.offset == "inverse" else []:
        keep[[pair.photo, pair.inverse]] = keep[pair.photo] and keep[pair.inverse]
    kept = {
        (p.frequency, p.kind)
        for p, is_kept in zip(plan.patterns, keep, strict=True)
        if is_kept and isinstance(p, Sinusoid)
    }
    for number, pattern in enumerate(plan.patterns):
        if isinstance(pattern, Sinusoid) and not pattern.frequency.is_own_negative:
            other = "sine" if pattern.kind == "cosine" else "cosine"
            keep[number] &= (pattern.frequency, other) in kept
    try:
        measurements = measure(fits.without_drift.only(np.flatnonzero(keep)))
    except InputError:
        return None
    try:
        q = correspond_by_phase(measurements, pitch=plan.pitch).q
    except InputError:
        # The lowest frequencies, which place q, are among those that were left out.
        q = known
    return estimate_jointly(measurements, q, plan.window, plan.far, pitch=plan.pitch, sweeps=SWEEPS)


def _explain_all(
    all_fits: PhotoFits, without: Transport, suspects: list[int], good: Booleans
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
    """
    fits = fit_photos(all_fits.without_drift, without)
    own = {number: float(fits.misfit[number]) for number in suspects}
    usual = max(1.0, float(np.median(list(own.values()))))
    found: dict[int, Explanation | None] = {}
    for number in suspects:
        if own[number] < SUSPECT_MISFIT:
            continue
        best = _simplest(list(_explanations(fits, fits.plan, number)))
        if best.explains(own[number]):
            if not _is_shared(fits, best, number, good):
                found[number] = best
        elif own[number] > UNEXPLAINED_RATIO * usual and _surprises(fits, without, number):
            found[number] = None
    return found


def _surprises(fits: PhotoFits, without: Transport, number: int) -> bool:
    """Return whether a photo differs by more than the error bars of its picture expect.

    Where no other photo tells of its pattern, it may well differ by far more than noise.
    """
    plan = fits.plan
    light = plan.draw(number) / np.float32(255)
    bars = ErrorBars(without).picture(light).reshape(fits.white.shape)
    is_known = np.isfinite(bars)
    variance = fits.variance[number] + np.where(is_known, bars, np.inf) ** 2
    squares = (fits.photos[number] - fits.relit[number]) ** 2 / variance
    return float(squares.sum() / max(1, is_known.sum())) > SUSPECT_MISFIT


def _simplest(explanations: list[Explanation]) -> Explanation:
    """Return the first of those that explain a photo about as well as the best."""
    least = min(each.misfit for each in explanations)
    return next(each for each in explanations if each.misfit <= AS_GOOD * least)


def _explanations(fits: PhotoFits, plan: Plan, number: int) -> Iterator[Explanation]:
    """Yield what a photo could be; the simplest first."""
    photo, relit = fits.photos[number], fits.relit[number]
    weight = 1 / fits.variance[number]

    def squares(picture: Floats) -> Floats:
        return np.asarray(weight * (photo - picture) ** 2)

    values = photo.size
    for other in range(len(fits.photos)):
        if plan.patterns[other] != plan.patterns[number]:
            yield Explanation("order", float(squares(fits.relit[other]).mean()), other)
    for how, turn in TURNS:
        turned = weight * (photo - turn(relit)) ** 2
        yield Explanation("turned", float(turned.mean()), how=how)
    channels = photo.shape[2]
    for order in list(permutations(range(channels)))[1:] if 1 < channels <= 4 else []:
        yield Explanation("colours", float(squares(relit[..., list(order)]).mean()))
    yield exposure_change(fits, number)
    own = squares(relit).sum(axis=(1, 2))
    for other in range(max(0, number - TORN_REACH), min(len(fits.photos), number + TORN_REACH + 1)):
        if plan.patterns[other] == plan.patterns[number]:
            continue
        theirs = squares(fits.relit[other]).sum(axis=(1, 2))
        # Rows up to each are of one pattern, all others of the other.
        above = np.concatenate([[0.0], np.cumsum(theirs - own)])[1:-1]
        if len(above):
            below = (theirs - own).sum() - above
            torn = own.sum() + min(above.min(), below.min())
            yield Explanation("torn", float(torn / values), other)
        odd = np.arange(len(own)) % 2 == 1
        interlaced = min(np.where(odd, own, theirs).sum(), np.where(odd, theirs, own).sum())
        yield Explanation("interlaced", float(interlaced / values), other)


def exposure_change(fits: PhotoFits, number: int) -> Explanation:
    """Return the change of lamp and ambient light that fits a photo best.

    It explains nothing if it is small; nor if the photo and that of the inverse pattern sum to
    white without it, as then the model is wrong and the light was not.

    Parameters
    ----------
    fits : PhotoFits
    number : int
        Of the photo.
    """
    lit = fits.relit[number] - fits.black
    effects = np.stack([lit.ravel(), np.ones(lit.size, dtype=np.float32)]).astype(np.float64)
    weight = 1 / fits.variance[number].ravel()
    weighted = effects * weight
    # What is left of the photo, and of its sum with that of the inverse pattern.
    differences = [(fits.photos[number] - fits.relit[number]).ravel()]
    for inverse in fits.inverses.get(number, ()):
        differences.append(differences[0] + (fits.photos[inverse] - fits.relit[inverse]).ravel())
    solved, *of_sums = (
        np.linalg.lstsq(weighted @ effects.T, weighted @ difference, rcond=None)[0]
        * [1.0, 1.0 / mean_white(fits)]
        for difference in differences
    )
    rest = differences[0] - (solved * [1.0, mean_white(fits)]) @ effects
    misfit = float((weight * rest**2).mean())
    largest = float(np.abs(solved).max())
    if largest < SMALLEST_CHANGE or any(
        float(np.abs(of_sum).max()) < LEAST_IN_SUM * largest for of_sum in of_sums
    ):
        misfit = np.inf
    return Explanation("exposure", misfit, gain=float(solved[0]), offset=float(solved[1]))


def _as_faults(explained: Mapping[int, Explanation | None]) -> list[Spoilt]:
    """Join photos that are spoilt in the same way."""
    found: list[Spoilt] = []

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
