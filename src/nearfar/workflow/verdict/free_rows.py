"""The verdict on free rows: by photos that are left out of the estimate of a sample of pixels."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats
from nearfar.capture import Capture
from nearfar.estimate.free_rows.design import Design, design_of
from nearfar.estimate.free_rows.error_bars import variance_in_noise
from nearfar.estimate.free_rows.estimate import FreeRows, estimate_free_rows, posterior_of
from nearfar.transport.posterior import FreePosterior
from nearfar.transport.verdict import (
    LARGEST_WIDENING,
    PATTERNS_SHOWN,
    Grade,
    KeptVerdict,
    Reason,
)
from nearfar.workflow.verdict.checked import CheckedLight, Judged
from nearfar.workflow.verdict.verdict import DOUBTFUL_DECIBELS, WRONG_DECIBELS
from nearfar.workflow.verdict.widening import SPREAD, SURE_DEVIATIONS

# Camera pixels that are judged.
HELD_OUT_PIXELS = 512
# Share of the photos that are held out, and fewest; they are chosen evenly.
HELD_OUT_SHARE = 0.04
FEWEST_HELD_OUT = 2
# Share of its own light that a held-out photo may tell by itself, where all lamps are told apart.
MOST_TOLD = 0.8
# Held-out noise below this share of its power is no error of the transport.
LEAST_ERROR = 0.05
# No camera tells more.
HIGHEST_DECIBELS = 200.0


def split_photos(capture: Capture) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the photos to estimate from, and the check photos of the plan."""
    is_check = np.array([pattern.purpose == "check" for pattern in capture.plan.patterns])
    return np.flatnonzero(~is_check), np.flatnonzero(is_check)


def judge_free_rows(
    photos: Floats,
    patterns: Floats,
    used: NDArray[np.int64],
    checks: NDArray[np.int64],
    lamps: NDArray[np.int64] | None,
) -> Judged:
    """Judge free rows by check photos, or by photos held out from those that can be spared.

    Parameters
    ----------
    photos : ndarray, shape (n, channels, N)
        Of some camera pixels.
    patterns : ndarray, shape (N, P)
    used, checks : ndarray of int
        Numbers of the photos to estimate from, and of the check photos.
    lamps : ndarray of int, shape (n,), optional
        As `estimate_free_rows`.

    Returns
    -------
    Judged
    """
    held_out = checks if len(checks) else _held_out(patterns, used)
    if not len(held_out):
        reason = Reason(
            "unchecked",
            "nothing was checked: every photo is needed to tell the lamps apart. Take some "
            "patterns more, such as random ones.",
        )
        return Judged(KeptVerdict("doubtful", (reason,)))
    kept = np.setdiff1d(used, held_out)
    design = design_of(patterns[kept])
    rows = estimate_free_rows(photos[..., kept], design, lamps)
    lights = patterns[held_out].astype(np.float64)
    seen = photos[..., held_out] - rows.black[..., None]
    squares = ((_relit(rows, lights) - seen) ** 2).reshape(-1, len(lights))
    # The photos' own noise is no error of the transport.
    noise = float(np.mean(rows.noise.astype(np.float64) ** 2))
    measured = float(np.mean(squares)) - noise
    hidden = noise * _hidden_share(squares.size)
    signal = float(np.mean(seen**2))
    snr = _decibels(signal, max(measured, hidden))
    found = KeptVerdict(
        "good",
        held_out_snr=snr,
        checked_by="lights of the check photos" if len(checks) else PATTERNS_SHOWN,
        is_least=measured < hidden,
    )
    posterior = posterior_of(design, rows.ratio)
    expected: list[float] | None = None
    if posterior is not None:
        expected = [_expected(design, posterior, rows, light) for light in lights]
        errors = max(measured - hidden, 0.0)
        found = _beside(found, signal, errors, float(np.mean(expected)), len(lights))
    checked = _one_by_one(held_out, seen, squares, noise, expected)
    if snr >= DOUBTFUL_DECIBELS:
        return Judged(found, checked)
    reason = Reason(
        "too-few-photos",
        "held-out photos differ from what is relit: give more photos, and check that lamps and "
        "camera are linear and nothing moved.",
    )
    grade: Grade = "wrong" if snr < WRONG_DECIBELS else "doubtful"
    return Judged(replace(found, grade=grade, reasons=(reason,)), checked)


def _hidden_share(count: int) -> float:
    """Return the share of the noise's power by which a mean of squares may be off.

    As much of the errors is hidden by it.
    """
    return LEAST_ERROR + SURE_DEVIATIONS * float(np.sqrt(2 / count))


def _decibels(signal: float, error: float) -> float:
    return min(float(10 * np.log10(max(signal, 1e-30) / max(error, 1e-30))), HIGHEST_DECIBELS)


def _one_by_one(
    photos: NDArray[np.int64],
    seen: Floats,
    squares: Floats,
    noise: float,
    expected: list[float] | None,
) -> tuple[CheckedLight, ...]:
    """Compare each held-out photo by itself.

    Parameters
    ----------
    photos : ndarray of int, shape (L,)
    seen : ndarray, shape (n, channels, L)
    squares : ndarray, shape (n * channels, L)
        Of the differences from what is relit.
    noise : float
        Variance of a photo.
    expected : list of float, optional
        Mean square of the error that the error bars expect of each.
    """
    signals = np.mean(seen**2, axis=(0, 1)).tolist()
    errors = np.maximum(squares.mean(axis=0) - noise, noise * _hidden_share(len(squares))).tolist()
    return tuple(
        CheckedLight(
            int(photo),
            _decibels(signals[place], errors[place]),
            None if expected is None else _decibels(signals[place], expected[place]),
        )
        for place, photo in enumerate(photos)
    )


def _expected(design: Design, posterior: FreePosterior, rows: FreeRows, light: Floats) -> float:
    """Return the mean square of the errors that are expected of a photo under a light.

    They are those of the light and of the black together, which make up for one another.
    """
    total = float(light.sum())
    if design.has_black and total > 0:
        known = design.from_known[-1] + design.from_known[0] / total
        posterior = replace(
            posterior,
            mean=(known @ design.patterns).astype(np.float32),
            mean_variance=float((known**2).sum()),
        )
    (variance,) = variance_in_noise(posterior, rows.lamp, light[None], 1.0, 1.0)
    return float(np.mean(rows.noise.astype(np.float64) ** 2 * variance[:, None]))


def _beside(
    verdict: KeptVerdict, signal: float, error: float, expected: float, lights: int
) -> KeptVerdict:
    """Return a verdict with what the error bars expect, and what they are widened by."""
    ratio = error / max(expected, 1e-30)
    surely = ratio > 1 + SURE_DEVIATIONS * SPREAD / float(np.sqrt(lights))
    return replace(
        verdict,
        expected_snr=float(np.clip(10 * np.log10(signal / max(expected, 1e-30)), -200, 200)),
        error_ratio=ratio,
        widening=min(float(np.sqrt(ratio)), LARGEST_WIDENING) if surely else 1.0,
    )


def _relit(rows: FreeRows, lights: Floats) -> Floats:
    """Return pictures under lights (L, P), (n, channels, L)."""
    found = rows.free @ lights.T
    lit = np.flatnonzero(rows.lamp >= 0)
    found[lit] += rows.direct[lit][..., None] * lights.T[rows.lamp[lit]][:, None]
    return np.asarray(found)


def _held_out(patterns: Floats, used: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return photos to hold out, evenly among those that have a pattern.

    Where the patterns tell all lamps apart, those that are left must do so too.
    """
    structured = used[np.ptp(patterns[used], axis=1) > 0]
    count = max(FEWEST_HELD_OUT, round(HELD_OUT_SHARE * len(structured)))
    if len(structured) <= count:
        return np.array([], dtype=np.int64)
    whole = design_of(patterns[used])
    if not whole.is_complete:
        return _evenly(structured, count)
    # Left out, a photo that tells much by itself would be foretold worse than any relit picture.
    tells = (whole.basis**2).sum(axis=1) + (whole.directions**2).sum(axis=1)
    structured = used[(np.ptp(patterns[used], axis=1) > 0) & (tells < MOST_TOLD)]
    if not len(structured):
        return np.array([], dtype=np.int64)
    chosen = _evenly(structured, count)
    # Together they may tell what none of them tells alone.
    while len(chosen) and not _is_whole(patterns[np.setdiff1d(used, chosen)], whole):
        chosen = chosen[::2] if len(chosen) > 1 else chosen[:0]
    return np.asarray(chosen)


def _evenly(numbers: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Return some of the numbers, evenly spread and none twice."""
    places = np.linspace(0, len(numbers) - 1, count + 2).round().astype(int)[1:-1]
    return np.asarray(np.unique(numbers[places]))


def _is_whole(left: Floats, of: Design) -> bool:
    """Return whether some of the patterns tell apart, and the black, what all of them do."""
    fewer = design_of(left)
    return fewer.is_complete and fewer.has_black == of.has_black
