"""The verdict on a transport: good, doubtful or wrong, and why."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from nearfar.capture import Capture
from nearfar.faults import words
from nearfar.faults.of_capture import find_faults
from nearfar.faults.of_light import ExposureChanged, LampFlickers
from nearfar.faults.of_photos import NotLinear, Spoilt
from nearfar.faults.of_single_photos import (
    ColoursSwapped,
    PhotosDark,
    PhotosIncomplete,
    PhotosMixed,
    PhotosTorn,
    PhotosTurned,
    ShowsOtherPattern,
)
from nearfar.faults.records import Fault, LightDrifted, PairsDoNotAdd, PhotosSaturated
from nearfar.plan import Plan
from nearfar.plan.checks import check_lights
from nearfar.progress import Report, ignore_progress
from nearfar.transport.stored import StoredTransport
from nearfar.transport.verdict import Grade, KeptVerdict, Reason
from nearfar.workflow.diagnosis.diagnose import find_what_spoils
from nearfar.workflow.diagnosis.misfit_maps import MisfitMaps, describe_worst, measure_misfit
from nearfar.workflow.verdict.by_check_photos import measure_held_out, without_photos
from nearfar.workflow.verdict.by_correspondence import measure_by_correspondence
from nearfar.workflow.verdict.correspondence_lights import correspondence_lights
from nearfar.workflow.verdict.held_out import HeldOut
from nearfar.workflow.verdict.repeats import Repeats, measure_repeats
from nearfar.workflow.verdict.widening import widening_of

Cause = words.Cause | Literal["lamp", "model", "noise", "too-few-photos", "below-plan", "unchecked"]

# What a pattern and its inverse may show beyond white, as a share of white, and by how many
# standard deviations more they have to.
LARGEST_EXCESS, SURE_DEVIATIONS = 0.01, 2.0
# Power of the errors over what the error bars expect: above the first the transport is doubtful,
# above the second it is wrong.
DOUBTFUL_ERROR_RATIO = 2.0
# The same of fine lights, which error bars expect less well.
DOUBTFUL_FINE_ERROR_RATIO = 10.0
WRONG_ERROR_RATIO = 20.0
# Held-out SNR_b in dB above which a transport is neither doubtful nor wrong for an error that the
# error bars do not expect.
GOOD_DECIBELS = 40.0
# Held-out SNR_b in dB below which a transport is doubtful, or wrong, whatever was expected.
DOUBTFUL_DECIBELS = 25.0
WRONG_DECIBELS = 15.0

# A transport whose error bars hold is doubtful all the same if its held-out SNR_b lies so many dB
# below both what was planned for and what noise allows, and below this: pictures are off by 4 %.
MOST_BELOW_PLAN = 10.0
FAIR_DECIBELS = 28.0
# If it lies so far below them, and below this, it is wrong: pictures are off by a tenth.
WRONG_BELOW_PLAN = 15.0
POOR_DECIBELS = 20.0

# Above this, pictures and their inverses say surely that the response is not linear, unless the
# half-screens show half of it: a bend shows there as well, in light from the lit half.
SURE_EXCESS, MOST_BY_HALF_SCREENS = 0.05, 0.5

# Without error bars, errors as many dB above the noise of a photo are not due to it.
NOISE_DECIBELS = 6.0

# Below this, by as many standard deviations, error bars expect so much more error than there is
# that photos contradict each other.
SMALLEST_ERROR_RATIO = 0.5
# Up to this, check photos that fit badly do so by the error of the estimate.
USUAL_ERROR_RATIO = 1.5

# Photos that are of something else: what was estimated from them is wrong.
PHOTOS_OF_SOMETHING_ELSE = (
    ShowsOtherPattern,
    PhotosTurned,
    PhotosTorn,
    PhotosMixed,
    PhotosDark,
    ColoursSwapped,
    PhotosIncomplete,
)
CAUSES_OF_FAULTS: Mapping[type[Any], Cause] = {
    PairsDoNotAdd: "not-linear",
    LightDrifted: "lamp",
    PhotosSaturated: "saturated",
}
# Why nothing was checked although there are photos to check by.
OF_SQUARE = "nothing was checked: a square T is of no single camera pixel's photos."
OF_SATURATED = "nothing was checked: every camera pixel is saturated."
OF_SPOILT = "nothing was checked: every check photo, or that of its inverse pattern, is spoilt."
# What is wrong, and what to do.
SENTENCES: Mapping[Cause, str] = {
    "not-linear": str(NotLinear("")),
    "lamp": "the light changed meanwhile: let the lamp warm up, and shut out other light.",
    "saturated": "photos are saturated: expose less.",
    "model": "the scene has light that the model cannot represent, or something moved.",
    "noise": "the photos are noisy: expose longer, or average several.",
    "too-few-photos": "too little was measured: plan for more photos.",
    "below-plan": (
        "pictures are relit far worse than planned for, and noise is not why: the scene needs more "
        "photos than most, or the camera changes its photos; turn off noise reduction and "
        "sharpening, or plan for more photos."
    ),
    "unchecked": (
        "nothing was checked: the plan has neither check photos, nor stripes or Gray code that "
        "serve as well."
    ),
}


@dataclass(frozen=True)
class Verdict:
    """The grade of a transport, the reasons for it, and the comparison with held-out photos.

    Attributes
    ----------
    grade : {"good", "doubtful", "wrong"}
    held_out : HeldOut or None
        None if nothing was checked.
    reasons : tuple of Reason
        Why the transport is not good, the most probable first.
    misfit : MisfitMaps or None
        Where photos do not fit, if it was measured.
    planned_snr : tuple of float or None
        Lowest and highest SNR_b under pictures that the plan was chosen for, dB; None if it was not
        chosen for any.
    """

    grade: Grade
    held_out: HeldOut | None
    reasons: tuple[Reason, ...]
    misfit: MisfitMaps | None = field(default=None, compare=False)
    planned_snr: tuple[float, float] | None = None

    @property
    def kept(self) -> KeptVerdict:
        """The part of the verdict that is stored with the transport."""
        checked = self.held_out
        if checked is None:
            return KeptVerdict(self.grade, self.reasons, planned_snr=self.planned_snr)
        return KeptVerdict(
            self.grade,
            self.reasons,
            _finite(checked.snr),
            _finite(checked.expected_snr),
            _finite(checked.error_ratio),
            widening_of(checked),
            checked.called,
            checked.is_least,
            _finite(checked.noise_snr),
            self.planned_snr,
        )

    @property
    def causes(self) -> tuple[str, ...]:
        """Causes of the reasons, each once."""
        return self.kept.causes

    def as_json(self) -> dict[str, Any]:
        """Return the verdict as a mapping of JSON types, for ``nearfar reconstruct --json``."""
        return self.kept.as_json()

    def __str__(self) -> str:
        return str(self.kept)


def _finite(number: float | None) -> float | None:
    """Return a number; None in place of one that is not finite, as where no pixel is usable."""
    return float(number) if number is not None and np.isfinite(number) else None


def judge_reconstruction(
    transport: StoredTransport, capture: Capture, progress: Report = ignore_progress
) -> Verdict:
    """Return the verdict on a transport, by the capture that it was reconstructed from.

    Parameters
    ----------
    transport : StoredTransport
    capture : Capture
    progress : callable
        Called with the step and the share of it that is done.

    Raises
    ------
    UnreadableFileError
        If the transport or the capture is damaged.
    """
    square, plan = transport.provenance["square"], capture.plan
    held_out = by_pictures = None
    if not square:
        by_pictures = measure_held_out(transport, capture, progress)
        held_out = by_pictures or measure_by_correspondence(transport, capture, progress)
    suspected = None if held_out is None else _hints(held_out)
    spoilt = find_what_spoils(transport, capture, progress, suspected=suspected)
    unchecked = _why_unchecked(transport, plan)
    if by_pictures is not None:
        # Photos that are of something else tell nothing of the transport.
        of_no_use = _of_something_else(spoilt) | _under_other_light(spoilt, plan)
        held_out = without_photos(by_pictures, plan, of_no_use)
        unchecked = OF_SPOILT
    verdict = judge(
        held_out,
        find_faults(capture, transport.provenance),
        spoilt,
        None if held_out else measure_repeats(capture, transport.provenance, progress),
        unchecked,
        None if (planned := plan.expected_snr) is None else planned.pictures,
        checks=[n for n, pattern in enumerate(plan.patterns) if pattern.purpose == "check"],
    )
    if "model" not in verdict.causes:
        return verdict
    misfit = measure_misfit(transport, capture, progress)
    return verdict if misfit is None else replace(with_worst(verdict, misfit), misfit=misfit)


def with_worst(verdict: Verdict, misfit: MisfitMaps) -> Verdict:
    """Return a verdict whose reason that the model fails names where, if anything stands out."""
    worst = describe_worst(misfit)
    if not worst:
        return verdict
    reasons = tuple(
        reason._replace(sentence=f"{reason.sentence.removesuffix('.')}; {worst}.")
        if reason.cause == "model"
        else reason
        for reason in verdict.reasons
    )
    return replace(verdict, reasons=reasons)


def judge(
    held_out: HeldOut | None,
    faults: Sequence[Fault],
    spoilt: Sequence[Spoilt] = (),
    repeats: Repeats | None = None,
    unchecked: str = SENTENCES["unchecked"],
    planned_snr: tuple[float, float] | None = None,
    checks: Collection[int] = (),
) -> Verdict:
    """Return the verdict on a transport.

    Parameters
    ----------
    held_out : HeldOut or None
        None if nothing was checked.
    faults : sequence of Fault
        Of the capture.
    spoilt : sequence of Spoilt
        Causes that spoil its photos.
    repeats : Repeats, optional
        Noise, drift and linearity of the capture, where nothing was checked.
    unchecked : str
        Why nothing was checked, if it was not.
    planned_snr : tuple of float, optional
        As `Verdict` has it.
    checks : collection of int
        Numbers of the check photos. A transport is not wrong for those that are spoilt, as no
        estimate uses them.
    """
    harmless = [each for each in spoilt if (of := _of_something_else([each])) and of <= set(checks)]
    spoilt = [each for each in spoilt if each not in harmless]
    of_checks = [Reason(each.cause, f"{each} {_that_it_checks(each)}") for each in harmless]
    if held_out is not None and _bends(held_out):
        # What bends the response makes pictures of other brightness than expected, too.
        spoilt = [NotLinear("") if _is_of_brightness(each) else each for each in spoilt]
    reasons = [Reason(each.cause, str(each)) for each in spoilt]

    def add(cause: Cause) -> None:
        if all(reason.cause != cause for reason in reasons):
            reasons.append(Reason(cause, SENTENCES[cause]))

    for fault in faults:
        # What is known of the photos says more.
        if (cause := CAUSES_OF_FAULTS.get(type(fault))) is not None and (
            not spoilt or cause == "saturated"
        ):
            add(cause)
    if held_out is None:
        known = "" if repeats is None else f" Known is this: {repeats}"
        reasons += [Reason("unchecked", unchecked + known), *of_checks]
        wrong = bool(_of_something_else(spoilt))
        grade: Grade = "wrong" if wrong else "doubtful"
        return Verdict(grade, None, tuple(reasons), planned_snr=planned_snr)
    if not spoilt:
        if _is_sure(held_out.nonlinear_excess, held_out.nonlinear_excess_deviation):
            add("not-linear")
        elif not reasons and _is_sure(held_out.lamp_excess, held_out.lamp_excess_deviation):
            add("lamp")
    surprises = _surprises(held_out, DOUBTFUL_ERROR_RATIO) or (
        held_out.fine and _surprises(HeldOut(held_out.fine), DOUBTFUL_FINE_ERROR_RATIO)
    )
    if surprises and not reasons:
        add("model")
    if not reasons and _is_below_plan(held_out, planned_snr, FAIR_DECIBELS, MOST_BELOW_PLAN):
        add("below-plan")
    if not reasons and held_out.snr < DOUBTFUL_DECIBELS:
        add(_what_limits(held_out))
    wrong = (
        held_out.snr < WRONG_DECIBELS
        or _is_below_plan(held_out, planned_snr, POOR_DECIBELS, WRONG_BELOW_PLAN)
        or _surprises(held_out, WRONG_ERROR_RATIO)
        or bool(_of_something_else(spoilt))
    )
    reasons += of_checks
    grade = "wrong" if wrong else "doubtful" if reasons else "good"
    return Verdict(grade, held_out, tuple(reasons), planned_snr=planned_snr)


def _of_something_else(spoilt: Iterable[Spoilt]) -> set[int]:
    """Return the numbers of the photos that surely are of something else than planned."""
    return {
        number
        for each in spoilt
        if isinstance(each, PHOTOS_OF_SOMETHING_ELSE)
        for number in each.photos
    }


def _under_other_light(spoilt: Iterable[Spoilt], plan: Plan) -> set[int]:
    """Return the check photos under other light than the photos of their inverse patterns.

    What the transport or a bent response is off by shows in both.
    """
    named = {
        number for each in spoilt if isinstance(each, ExposureChanged) for number in each.photos
    }
    sides = (
        (one, other)
        for light in check_lights(plan)
        for one, other in ((light.photos, light.inverses), (light.inverses, light.photos))
    )
    return {n for one, other in sides if not named & set(other) for n in named & set(one)}


def _that_it_checks(each: Spoilt) -> str:
    """Return that photos serve for nothing but checks, a sentence."""
    if len(_of_something_else([each])) == 1:
        return "It is a check photo: the transport is estimated without it."
    return "They are check photos: the transport is estimated without them."


def _why_unchecked(transport: StoredTransport, plan: Plan) -> str:
    """Return why nothing was checked, if it was not."""
    if transport.provenance["square"]:
        return OF_SQUARE
    is_told = plan.offset == "reference" and check_lights(plan)
    return OF_SATURATED if is_told or correspondence_lights(plan) else SENTENCES["unchecked"]


def _is_sure(excess: float, deviation: float) -> bool:
    """Return whether photos of patterns and their inverses surely do not sum to white."""
    return abs(excess) - SURE_DEVIATIONS * deviation > LARGEST_EXCESS


def _surprises(held_out: HeldOut, most: float) -> bool:
    """Return whether errors matter, and are larger than the error bars expect by so much."""
    return (held_out.error_ratio or 0.0) > most and held_out.snr < GOOD_DECIBELS


def _is_below_plan(
    held_out: HeldOut, planned_snr: tuple[float, float] | None, fair: float, most: float
) -> bool:
    """Return whether pictures are relit worse than fair, and far below plan and noise, in dB."""
    allowed = held_out.noise_snr
    if planned_snr is None or allowed is None or held_out.snr > fair:
        return False
    return min(planned_snr[0], allowed) - held_out.snr > most


def _what_limits(held_out: HeldOut) -> Cause:
    """Return why pictures are relit badly where nothing was found in the photos."""
    share = held_out.unmeasured_share
    if share is not None:
        return "too-few-photos" if share > 1 / 2 else "noise"
    photos = float(np.mean([light.photo_snr for light in held_out.lights]))
    return "model" if photos > held_out.snr + NOISE_DECIBELS else "noise"


def _bends(held_out: HeldOut) -> bool:
    """Return whether pictures and their inverses do not sum to white; half-screens may nearly."""
    excess = abs(held_out.nonlinear_excess)
    return excess > SURE_EXCESS and abs(held_out.lamp_excess) < MOST_BY_HALF_SCREENS * excess


def _hints(held_out: HeldOut) -> bool | None:
    """Return whether error bars and check photos hint at spoilt photos; None if they may.

    They do where error bars are surely far too large, as where photos contradict each other.
    """
    ratio = held_out.error_ratio
    if ratio is None or ratio > USUAL_ERROR_RATIO:
        return None
    return ratio + SURE_DEVIATIONS * (held_out.error_ratio_deviation or 0.0) < SMALLEST_ERROR_RATIO


def _is_of_brightness(each: Spoilt) -> bool:
    """Return whether photos are brighter or darker by a factor."""
    if isinstance(each, ExposureChanged):
        return abs(each.gain) > abs(each.offset)
    return isinstance(each, LampFlickers)
