"""Diagnosis of the photos of a capture, by all checks."""

from collections.abc import Callable, Sequence

import numpy as np

from nearfar.arrays import Floats
from nearfar.capture import Capture
from nearfar.errors import InputError
from nearfar.estimate.joint import estimate_by_sweeps
from nearfar.faults.of_light import AmbientFlickers, ExposureChanged, LampFlickers
from nearfar.faults.of_photos import Moved, NotLinear, Spoilt
from nearfar.faults.of_single_photos import PhotosTorn
from nearfar.photometry.drift import Drift, References, find_references
from nearfar.photometry.measure import measure
from nearfar.progress import Report, ignore_progress
from nearfar.transport.model import Transport
from nearfar.transport.stored import StoredTransport
from nearfar.workflow.diagnosis.bend_of_pairs import Bend, bend_of_pairs
from nearfar.workflow.diagnosis.changed_references import (
    find_changed_references,
    find_flashing_pixels,
)
from nearfar.workflow.diagnosis.clipped import find_clipped_black, find_clipped_white
from nearfar.workflow.diagnosis.compression import find_compression
from nearfar.workflow.diagnosis.explanations import SUSPECT_MISFIT
from nearfar.workflow.diagnosis.following import find_following_of_pattern
from nearfar.workflow.diagnosis.incomplete import find_incomplete
from nearfar.workflow.diagnosis.inverse_pairs import (
    are_linear,
    find_motion_by_pairs,
    has_odd_pairs,
    steady_pairs,
)
from nearfar.workflow.diagnosis.jumps import find_jump_of_colours, mean_light, name_jumps
from nearfar.workflow.diagnosis.left_out import SWEEPS
from nearfar.workflow.diagnosis.lingering import find_lingering_patterns
from nearfar.workflow.diagnosis.misfit import (
    PhotoFits,
    SteadyPhotos,
    fit_photos,
    inverse_photos,
    is_white_or_black,
    normal_equations,
    serves,
)
from nearfar.workflow.diagnosis.odd_references import find_odd_references
from nearfar.workflow.diagnosis.sample import CameraSample, sample_camera
from nearfar.workflow.diagnosis.sequence import find_other_order
from nearfar.workflow.diagnosis.shifted_patterns import find_shifted_patterns
from nearfar.workflow.diagnosis.shifted_whites import find_shifted_whites
from nearfar.workflow.diagnosis.single_photos import SpoiltPhotos, find_spoilt_photos
from nearfar.workflow.diagnosis.whole_capture import find_changes, name_encoding

# What a response that is not linear, or JPEG, looks like.
OF_RESPONSE = (NotLinear, ExposureChanged, LampFlickers)
# What single photos that do not fit make of others.
OF_LIGHT = (ExposureChanged, LampFlickers)
# Where ambient light flickers, photos of black deviate by this share of its deviation at least.
LEAST_OF_BLACK = 0.2
# A lamp that flickers changes single photos by no more than so many of its standard deviations, of
# which the estimate hides a part.
LARGEST_OF_FLICKER = 10.0
# Bend of the response that the sums of all inverse photos show, at least, and over its deviation.
LEAST_SHARED_BEND, SURE_DEVIATIONS = 0.02, 5.0
# A response that bends by more makes some of the noise of dark camera pixels look like flashes.
BEND_WITH_FLASHES = 0.05


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
        a square T. Inverse pairs tell of motion, JPEG and single photos alone; that their response
        is not linear is a fault of the capture.

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
        found = _what_spoils_pairs(transport, sample, compressed)
        progress(step, 1.0)
        return found
    references = find_references(plan)
    # These are certain without an estimate, which they spoil.
    found = [
        *find_other_order(sample.photos, plan),
        *find_incomplete(sample.photos, references.blacks),
        *find_shifted_whites(capture, references),
    ]
    if not found:
        found = _what_does_not_fit(
            transport, sample, compressed, lambda share: progress(step, share), suspected=suspected
        )
    progress(step, 1.0)
    if clipped := find_clipped_white(sample):
        # What is cut off is not linear.
        found = [each for each in found if not isinstance(each, OF_RESPONSE)]
    return [*clipped, *found]


def _what_does_not_fit(
    transport: StoredTransport,
    sample: CameraSample,
    compressed: Sequence[Spoilt],
    progress: Callable[[float], None],
    *,
    suspected: bool | None,
) -> list[Spoilt]:
    """Find what spoils photos by reference, by how they fit the transport; the worst first."""
    try:
        photos = sample.without_drift()
    except InputError:
        # Nothing but saturated camera pixels were sampled.
        return []
    sampled = _estimate_of(transport, sample, photos)
    fits = fit_photos(photos, sampled)
    progress(3 / 4)
    if lingering := find_lingering_patterns(fits, photos.drift.references.whites):
        # They spoil all photos, whatever else these look like.
        return [*compressed, *lingering]
    single = find_spoilt_photos(fits, sampled.correspondence, suspected=suspected)
    found = [*single.certain, *single.probable]
    if not single.certain:
        found = _what_changed(sample, fits, photos.drift, single, compressed, suspected=suspected)
    # Fine patterns that are shifted far look like others, or like a smaller shift at some moment.
    used = ~serves(fits.plan, "check", "correspondence")
    is_odd = bool(single.certain or single.probable) or any(map(_is_of_projector, found))
    is_odd |= float(fits.misfit[used].max()) > SUSPECT_MISFIT
    if is_odd and (shifted := find_shifted_patterns(fits, sampled.correspondence)):
        return [*compressed, *shifted]
    if single.certain and all(isinstance(each, PhotosTorn) for each in single.certain):
        # So look photos of a scene of which a part moved.
        changed = find_changed_references(fits.without_drift, photos.drift.references)
        return [*changed] or found
    return found


def _is_of_projector(found: Spoilt) -> bool:
    return isinstance(found, Moved) and found.what == "projector"


def _what_changed(
    sample: CameraSample,
    fits: PhotoFits,
    drift: Drift,
    single: SpoiltPhotos,
    compressed: Sequence[Spoilt],
    *,
    suspected: bool | None,
) -> list[Spoilt]:
    """Find what spoils all photos, or many, where no single one is certainly spoilt."""
    equations, misfit = normal_equations(sample, fits), fits.misfit
    if suspected is False:
        checks = serves(fits.plan, "check")
        equations, misfit = equations.without(checks), np.where(checks, 1.0, misfit)
    references, of_pairs = drift.references, bend_of_pairs(fits)
    found = find_changes(equations, misfit, references.whites, inverse_photos(fits.plan), of_pairs)
    # Others look spoilt because the drift is told by these, unless these moved with others.
    odd = find_odd_references(sample.photos, references)
    steady = fits.without_drift
    is_bent = of_pairs is not None and abs(of_pairs.size) > BEND_WITH_FLASHES
    if not (compressed or is_bent) and (
        flashing := find_flashing_pixels(steady, sample.photos, references)
    ):
        odd = [*flashing]
    if odd and not any(isinstance(each, Moved) for each in found):
        return odd
    if found and isinstance(found[0], Moved):
        # What moved makes photos brighter or darker.
        found = [each for each in found if not isinstance(each, (*OF_LIGHT, AmbientFlickers))]
    if changed := find_changed_references(steady, references):
        # It makes other photos brighter or darker, too, and bends their sums. Ambient light that
        # flickers makes photos of white differ.
        surer = [each for each in found if _is_surer(each, sample.photos, references)]
        return [*compressed, *find_clipped_black(sample), *(surer or changed)]
    if jumped := find_jump_of_colours(drift.lamp, references.whites):
        # Photos about it look brighter or darker.
        return [*compressed, *(each for each in found if not isinstance(each, OF_LIGHT)), *jumped]
    bends = _bends_all_pairs(of_pairs, found)
    # The estimate bends to single photos that stand out, so that others look darker or brighter.
    is_of_single = single.stand_out and all(isinstance(each, OF_LIGHT) for each in found)
    is_of_single &= not _are_of_flicker(single.probable, found)
    if is_of_single or not (found or bends):
        return [*compressed, *name_jumps(single.probable, sample.photos, references)]
    response = _response(sample, fits, references, found, compressed, bends=bends)
    if response:
        found = [each for each in found if not isinstance(each, OF_RESPONSE)]
    return [*response, *name_jumps(found, sample.photos, references)]


def _response(
    sample: CameraSample,
    fits: PhotoFits,
    references: References,
    found: Sequence[Spoilt],
    compressed: Sequence[Spoilt],
    *,
    bends: bool,
) -> list[Spoilt]:
    """Return why the response is not linear; empty if no reason was found."""
    # Black may well be at the lowest level; it is clipped if photos do not fit.
    response: list[Spoilt] = [*compressed, *find_clipped_black(sample)]
    if not response and (encoding := name_encoding(sample)):
        response = [NotLinear(encoding)]
    elif not response and (bends or any(isinstance(each, NotLinear) for each in found)):
        response = [*find_following_of_pattern(fits, references)]
    if not response and bends:
        response = [NotLinear("")]
    return response


def _is_surer(found: Spoilt, photos: Floats, references: References) -> bool:
    """Return whether it says more than that parts of white changed.

    Ambient light that flickers does so in the photos of black, too. All photos of the sample are
    given as they were taken, (photos, rows, columns, channels).
    """
    if isinstance(found, AmbientFlickers):
        black = photos[references.blacks].mean(axis=(1, 2, 3)) / mean_light(photos, references)
        return float(np.std(black)) > LEAST_OF_BLACK * found.deviation
    return isinstance(found, Moved)


def _are_of_flicker(single: Sequence[Spoilt], found: Sequence[Spoilt]) -> bool:
    """Return whether single photos under another exposure are those of a lamp that flickers."""
    deviation = max((each.deviation for each in found if isinstance(each, LampFlickers)), default=0)
    return all(
        isinstance(each, ExposureChanged) and abs(each.gain) < LARGEST_OF_FLICKER * deviation
        for each in single
    )


def _bends_all_pairs(of_pairs: Bend | None, found: Sequence[Spoilt]) -> bool:
    """Return whether what looks like exposure bends the sums of all inverse photos alike."""
    return (
        of_pairs is not None
        and of_pairs.shared > max(LEAST_SHARED_BEND, SURE_DEVIATIONS * of_pairs.deviation)
        and all(isinstance(each, OF_RESPONSE) for each in found)
    )


def _estimate_of(
    transport: StoredTransport, sample: CameraSample, photos: SteadyPhotos
) -> Transport:
    """Return the joint estimate at the sampled camera pixels, by sweeps alone.

    The transport itself holds a part of what is wrong with photos, and those of other estimates
    differ from the photos by far more than noise.
    """
    plan, q = sample.plan, sample.of_transport(transport).correspondence
    return estimate_by_sweeps(
        measure(photos), q, plan.window, plan.far, pitch=plan.pitch, sweeps=SWEEPS
    )


def _what_spoils_pairs(
    transport: StoredTransport, sample: CameraSample, compressed: Sequence[Spoilt]
) -> list[Spoilt]:
    """Find what spoils the photos of inverse pairs; the worst first."""
    moved = find_motion_by_pairs(sample)
    if transport.provenance["square"]:
        return [*compressed, *moved]
    single = _single_photos_of_pairs(transport, sample)
    if single.certain:
        return [*single.certain, *single.probable]
    return [*compressed, *moved, *([] if moved else single.probable)]


def _single_photos_of_pairs(transport: StoredTransport, sample: CameraSample) -> SpoiltPhotos:
    """Find photos of inverse pairs that do not fit the others.

    A pair that sums to something else than the others has a spoilt photo, however well both fit.
    """
    photos = steady_pairs(sample)
    if not photos.unsaturated.any():
        return SpoiltPhotos([], [], stand_out=False)
    estimate = _estimate_of(transport, sample, photos)
    suspected = True if has_odd_pairs(photos) else None
    found = find_spoilt_photos(
        fit_photos(photos, estimate), estimate.correspondence, suspected=suspected
    )
    # A bent response makes photos darker or brighter, too.
    return found if are_linear(photos) else found._replace(probable=[])
