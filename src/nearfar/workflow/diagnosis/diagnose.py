"""Diagnosis of the photos of a capture, by all checks."""

import numpy as np

from nearfar.capture import Capture
from nearfar.errors import InputError
from nearfar.estimate.joint import estimate_jointly
from nearfar.faults.of_photos import ExposureChanged, LampFlickers, NotLinear, Spoilt
from nearfar.photometry.measure import measure
from nearfar.progress import Report, ignore_progress
from nearfar.transport.store import StoredTransport
from nearfar.workflow.diagnosis.compression import find_compression
from nearfar.workflow.diagnosis.inverse_pairs import find_motion_by_pairs
from nearfar.workflow.diagnosis.misfit import (
    fit_photos,
    is_white_or_black,
    normal_equations,
    serves,
)
from nearfar.workflow.diagnosis.sample import sample_camera
from nearfar.workflow.diagnosis.single_photos import SWEEPS, find_spoilt_photos
from nearfar.workflow.diagnosis.whole_capture import (
    find_changes,
    find_clipped_black,
    name_encoding,
)

# What a response that is not linear, or JPEG, looks like.
OF_RESPONSE = (NotLinear, ExposureChanged, LampFlickers)


def find_what_spoils(
    transport: StoredTransport,
    capture: Capture,
    progress: Report = ignore_progress,
    *,
    suspected: bool | None = None,
) -> list[Spoilt]:
    """Find what spoils the photos of a capture.

    Parameters
    ----------
    transport : StoredTransport
        Reconstructed from the capture.
    capture : Capture
    progress : callable
        Called with the step and the share of it that is done.
    suspected : bool or None
        Whether check photos and error bars hint at spoilt photos. If they do, photos that seem to
        fit are searched; if they do not, check photos that fit badly tell nothing, as they are off
        by the error of the estimate. None if they may.

    Returns
    -------
    list of Spoilt
        The worst first; empty if all is well, or if the photos cannot tell: those by reference of
        a square T. Inverse pairs tell of motion and JPEG alone; that their
        response is not linear is a fault of the capture.

    Raises
    ------
    UnreadableFileError
        If the transport or the capture is damaged.
    """
    plan = capture.plan
    by_pairs = plan.offset == "inverse"
    if transport.provenance["square"] and not by_pairs:
        return []
    step = "comparing photos"
    sample = sample_camera(capture, lambda share: progress(step, share / 2))
    compressed = find_compression(capture, ~is_white_or_black(plan))
    if by_pairs:
        moved = find_motion_by_pairs(sample)
        progress(step, 1.0)
        return [*compressed, *moved]
    try:
        photos = sample.without_drift()
    except InputError:
        # Nothing but saturated camera pixels were sampled.
        return []
    sampled = sample.of_transport(transport)
    if transport.provenance["method"] != "joint":
        # Other estimates differ from the photos by far more than noise.
        q = sampled.correspondence
        sampled = estimate_jointly(measure(photos), q, plan.window, plan.far, sweeps=SWEEPS)
    fits = fit_photos(photos, sampled)
    progress(step, 3 / 4)
    single = find_spoilt_photos(fits, sampled.correspondence, suspected=suspected)
    progress(step, 1.0)
    if single.certain:
        return [*single.certain, *single.probable]
    equations, misfit = normal_equations(sample, fits), fits.misfit
    if suspected is False:
        checks = serves(plan, "check")
        equations, misfit = equations.without(checks), np.where(checks, 1.0, misfit)
    found = find_changes(equations, misfit, photos.drift.references.whites)
    if not found:
        return [*compressed, *single.probable]
    # Black may well be at the lowest level; it is clipped if photos do not fit.
    response = [*compressed, *find_clipped_black(sample)]
    if not response and (encoding := name_encoding(sample)):
        response = [NotLinear(encoding)]
    if response:
        found = [each for each in found if not isinstance(each, OF_RESPONSE)]
    return [*response, *found]
