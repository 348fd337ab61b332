"""Estimates of the transport without some of the photos.

All codes of a plan are one measurement. So a code's photo is left out by taking a relit picture in
its place, again and again, until the transport is that of the other photos and the prior.
"""

from dataclasses import replace

import numpy as np

from nearfar.arrays import Booleans, Floats
from nearfar.correspondence import correspond_by_phase
from nearfar.errors import InputError
from nearfar.estimate.joint import errors_of_foretold, estimate_by_sweeps
from nearfar.photometry.by_codes import responses_of_photos, weighing_of
from nearfar.photometry.by_inverse import find_pairs
from nearfar.photometry.measure import measure
from nearfar.photometry.measurements import Measurements
from nearfar.plan import Plan, Sinusoid
from nearfar.transport.model import Transport
from nearfar.workflow.diagnosis.misfit import PhotoFits, relight, serves

# Photos of these purposes are not estimated from.
HELD_OUT = ("check", "correspondence")
# The photos of a frequency are foretold badly if the mean square of their errors is so many times
# the expected one, and so many times what this percentage of all frequencies have at most: what
# spoils all photos raises many. docs/decisions/0113 has what good captures reach.
LEAST_ERROR, STANDS_OUT, USUAL_PERCENT = 3.5, 2.5, 90
# The same in one place of the picture, as where a window pops up.
LEAST_LOCAL_ERROR, STANDS_OUT_LOCALLY, USUAL_LOCAL_PERCENT = 12.0, 5.0, 50
# Sweeps of the estimate.
SWEEPS = 2
# Times the noise that are counted while relit pictures take the place of codes' photos, round after
# round. What spoilt photos add to all responses would otherwise count as light, and hold the
# estimate to these photos: little of them is left before the noise counts as it is.
NOISE_OF_ROUNDS = (6.0, 6.0, 6.0, 1.0)


def estimate_without(
    fits: PhotoFits, good: Booleans, left_out: list[int], known: Floats
) -> Transport | None:
    """Estimate the transport without some photos; None if too few remain.

    Parameters
    ----------
    fits : PhotoFits
    good : ndarray of bool, shape (photos,)
        Photos that are to be used at all.
    left_out : list of int
        Good photos that are left out.
    known : ndarray, shape (rows, columns, 2)
        q, for where the remaining photos do not tell it.
    """
    keep = good & ~serves(fits.plan, *HELD_OUT)
    keep[left_out] = False
    if fits.plan.is_by_codes:
        return _without_codes(fits, keep, known)
    measurements = _measured(fits, keep)
    return None if measurements is None else _estimate(fits.plan, measurements, known)


def photos_not_foretold(fits: PhotoFits, good: Booleans, known: Floats) -> list[int]:
    """Return good photos of frequencies that the photos of all others foretell badly.

    Parameters
    ----------
    fits, good, known
        As `estimate_without` takes them.

    Returns
    -------
    list of int
        Empty for codes, and for functions of several projector pixels, of which nothing is known.
    """
    plan = fits.plan
    keep = good & ~serves(plan, *HELD_OUT)
    if plan.is_by_codes or plan.pitch > 1 or (measurements := _measured(fits, keep)) is None:
        return []
    errors = errors_of_foretold(measurements, _q_of(plan, measurements, known), plan.window)
    means, local = np.array(list(errors.values())).T
    # NaN stands out of nothing.
    stand_out = means > max(LEAST_ERROR, STANDS_OUT * np.percentile(means, USUAL_PERCENT))
    usual = np.percentile(local, USUAL_LOCAL_PERCENT)
    stand_out |= local > max(LEAST_LOCAL_ERROR, STANDS_OUT_LOCALLY * usual)
    odd = {frequency for frequency, is_odd in zip(errors, stand_out, strict=True) if is_odd}
    return [
        number
        for number, pattern in enumerate(plan.patterns)
        if keep[number]
        and isinstance(pattern, Sinusoid)
        and (pattern.frequency in odd or -pattern.frequency in odd)
    ]


def _measured(fits: PhotoFits, keep: Booleans) -> Measurements | None:
    """Measure responses by some photos; None if too few remain."""
    try:
        return measure(fits.without_drift.only(np.flatnonzero(_whole(fits.plan, keep))))
    except InputError:
        return None


def _whole(plan: Plan, keep: Booleans) -> Booleans:
    """Return which photos to keep whose partners are kept too: inverses, and sines of cosines."""
    keep = keep.copy()
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
    return keep


def _without_codes(fits: PhotoFits, keep: Booleans, known: Floats) -> Transport | None:
    """Estimate the transport with relit pictures in the place of photos that are not kept."""
    plan = fits.plan
    measuring = list(weighing_of(plan).place)
    replaced = [number for number in measuring if not keep[number]]
    if 2 * len(replaced) > len(measuring):
        return None
    measured, shown = measure(fits.without_drift), fits.photos[replaced]
    if not replaced:
        return _estimate(plan, measured, known)
    relit = fits.relit[replaced]
    for times in NOISE_OF_ROUNDS:
        noise = np.float32(times) * measured.noise
        change = (relit - shown).reshape(len(replaced), -1, shown.shape[-1])
        responses = measured.responses + responses_of_photos(plan, replaced, change)
        found = _estimate(plan, replace(measured, responses=responses, noise=noise), known)
        relit = relight(plan, found, replaced)
    return found


def _estimate(plan: Plan, measurements: Measurements, known: Floats) -> Transport:
    q = _q_of(plan, measurements, known)
    return estimate_by_sweeps(
        measurements, q, plan.window, plan.far, pitch=plan.pitch, sweeps=SWEEPS
    )


def _q_of(plan: Plan, measurements: Measurements, known: Floats) -> Floats:
    """Return q as measured, or as it is known where too little was measured for it."""
    try:
        return correspond_by_phase(measurements, pitch=plan.pitch).q
    except InputError:
        # The lowest frequencies, which place q, are among those that were left out.
        return known
