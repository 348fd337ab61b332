"""The verdict that is kept with a transport: whether it can be trusted, and why not."""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, get_args

from nearfar.decibels import ROUNDING, in_words

Grade = Literal["good", "doubtful", "wrong"]

# Of a transport without a verdict.
NOT_JUDGED = (
    "not judged: nothing is known of how far it can be trusted. Give the capture that it was "
    "reconstructed from as `capture` to judge it."
)
# Lights that the estimate never saw, where they are patterns that were left out of it.
PATTERNS_SHOWN = "patterns like those shown"
# What is beyond these in a file is no result of ours.
LARGEST_DECIBELS = 1000.0
LARGEST_RATIO = sys.float_info.max
# Error bars so far off mean nothing, however wide they are made.
LARGEST_WIDENING = 1e6


class Reason(NamedTuple):
    """Why a transport is not good.

    Attributes
    ----------
    cause : str
    sentence : str
        What is wrong, with the photos that it concerns, and what to do.
    """

    cause: str
    sentence: str


@dataclass(frozen=True)
class KeptVerdict:
    """What check photos, and faults of the others, said of a transport.

    Attributes
    ----------
    grade : {"good", "doubtful", "wrong"}
    reasons : tuple of Reason
        Why the transport is not good, the most probable first.
    held_out_snr : float or None
        Held-out SNR_b, dB; None if nothing was checked.
    expected_snr : float or None
        The SNR_b that the error bars expected before they were widened, dB; None if nothing was
        checked, or without error bars.
    error_ratio : float or None
        Power of the errors over that which the error bars expected; None as `expected_snr`.
    widening : float
        What all standard deviations are multiplied by for the error bars to hold, at least 1.
    checked_by : str
        The lights that the estimate never saw, in words.
    is_least : bool
        Whether the true SNR_b may be higher: noise hides all errors.
    noise_snr : float or None
        The SNR_b that the noise of the photos alone allows, dB: that of the part of the error that
        the error bars expect from noise. None as `expected_snr`.
    planned_snr : tuple of float or None
        Lowest and highest SNR_b under pictures that the plan was chosen for, dB; None if it was not
        chosen for any.
    """

    grade: Grade
    reasons: tuple[Reason, ...] = ()
    held_out_snr: float | None = None
    expected_snr: float | None = None
    error_ratio: float | None = None
    widening: float = 1.0
    checked_by: str = "pictures"
    is_least: bool = False
    noise_snr: float | None = None
    planned_snr: tuple[float, float] | None = None

    @property
    def causes(self) -> tuple[str, ...]:
        """Causes of the reasons, each once."""
        return tuple(dict.fromkeys(reason.cause for reason in self.reasons))

    @property
    def summary(self) -> str:
        """What held-out photos say of what is relit, and what was expected, a sentence.

        It is empty if nothing was checked and nothing expected.
        """
        planned = None if self.planned_snr is None else _range_in_words(self.planned_snr)
        if self.held_out_snr is None:
            return "" if planned is None else f"The plan was chosen for {planned}."
        beside = beside_held_out(self.expected_snr, self.planned_snr, self.noise_snr)
        widened = ""
        if self.widening > 1:
            widened = f"; error bars are made {self.widening:.2g} times as wide, to hold"
        least = "at least " if self.is_least else ""
        held_out = ", ".join([f"{least}{in_words(self.held_out_snr)}", *beside])
        # Patterns of two levels hardly show a bend of the response.
        is_hidden = "not-linear" in self.causes and self.checked_by == PATTERNS_SHOWN
        others = " Lights of other levels may be off by far more." if is_hidden else ""
        return (
            f"Relit {self.checked_by} are off by {_percent(10 ** (-self.held_out_snr / 20))} "
            f"(held-out SNR_b {held_out}){widened}.{others}"
        )

    @property
    def sentences(self) -> tuple[str, ...]:
        """What is wrong and what to do, for each reason; each begins with a capital."""
        return tuple(each.sentence[:1].upper() + each.sentence[1:] for each in self.reasons)

    def as_json(self) -> dict[str, Any]:
        """Return the verdict as a mapping of JSON types, for ``nearfar reconstruct --json``."""
        return {
            "verdict": self.grade,
            "held_out_dB": self.held_out_snr,
            "expected_dB": self.expected_snr,
            "planned_dB": None if self.planned_snr is None else list(self.planned_snr),
            "noise_dB": self.noise_snr,
            "causes": list(self.causes),
            "reasons": [reason.sentence for reason in self.reasons],
        }

    def __str__(self) -> str:
        return " ".join([f"{self.grade}:", *self.sentences, self.summary]).rstrip()


def beside_held_out(
    expected: float | None,
    planned: tuple[float, float] | None,
    noise: float | None,
    *,
    photos_planned: int | None = None,
) -> list[str]:
    """Return in words what a held-out SNR_b is read beside, as far as it is known.

    Parameters
    ----------
    expected, planned, noise : optional
        As `KeptVerdict.expected_snr`, `KeptVerdict.planned_snr` and `KeptVerdict.noise_snr`.
    photos_planned : int, optional
        How many photos the plan has, where fewer may have been taken: what was planned for is said
        to be of all of them.
    """
    said = [] if expected is None else [f"{expected:.1f} dB expected"]
    if planned is not None:
        of_all = "" if photos_planned is None else f" with all {photos_planned} photos"
        said.append(f"planned for {_range_in_words(planned)}{of_all}")
    if noise is not None and noise <= ROUNDING:
        said.append(f"noise alone allows {noise:.1f} dB")
    return said


def _range_in_words(planned: tuple[float, float]) -> str:
    lowest, highest = planned
    return f"{lowest:.0f} to {highest:.0f} dB under pictures"


def _percent(share: float) -> str:
    """Return a share in percent, of two digits at least."""
    return f"{100 * share:.2g} %" if share < 1 - 0.005 else f"{100 * share:.0f} %"


def verdict_to_json(verdict: KeptVerdict) -> dict[str, Any]:
    """Return a verdict as a transport's file holds it, of JSON types."""
    return {
        "grade": verdict.grade,
        "reasons": [reason._asdict() for reason in verdict.reasons],
        "held_out_dB": verdict.held_out_snr,
        "expected_dB": verdict.expected_snr,
        "error_ratio": verdict.error_ratio,
        "widening": verdict.widening,
        "checked_by": verdict.checked_by,
        "is_least": verdict.is_least,
        "noise_dB": verdict.noise_snr,
        "planned_dB": None if verdict.planned_snr is None else list(verdict.planned_snr),
    }


def verdict_from_json(kept: Mapping[str, Any]) -> KeptVerdict:
    """Read a verdict from a transport's file.

    Earlier versions kept neither what noise allows nor what was planned for.

    Raises
    ------
    KeyError, TypeError, ValueError
        If it is no verdict.
    """
    grade = kept["grade"]
    if grade not in get_args(Grade):
        raise ValueError(f"{grade!r} is no grade")
    reasons = tuple(
        Reason(_text(each["cause"]), _text(each["sentence"])) for each in kept["reasons"]
    )
    held_out, expected, noise = (
        None if value is None else _decibels(value)
        for value in (kept["held_out_dB"], kept["expected_dB"], kept.get("noise_dB"))
    )
    ratio = kept["error_ratio"]
    planned = kept.get("planned_dB")
    if planned is not None:
        lowest, highest = map(_decibels, planned)
        planned = lowest, highest
    widening = _number(kept["widening"], 1.0, LARGEST_WIDENING)
    return KeptVerdict(
        grade,
        reasons,
        held_out,
        expected,
        None if ratio is None else _number(ratio, 0.0, LARGEST_RATIO),
        widening,
        _text(kept["checked_by"]),
        kept["is_least"] is True,
        noise,
        planned,
    )


def _decibels(value: Any) -> float:
    return _number(value, -LARGEST_DECIBELS, LARGEST_DECIBELS)


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{value!r} is no text")
    return value


def _number(value: Any, least: float, largest: float) -> float:
    if isinstance(value, str) or not least <= float(value) <= largest:
        raise ValueError(f"{value!r} is no number from {least:g} to {largest:g}")
    return float(value)
