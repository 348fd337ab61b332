"""Reconstruct a transport from photos of anybody's patterns.

Index convention: photos are (C, channels, N), patterns (N, P).
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, Size
from nearfar.capture import Capture
from nearfar.correspondence import Correspondence
from nearfar.errors import InputError
from nearfar.estimate.any_patterns import estimate_from_patterns
from nearfar.estimate.any_patterns.covariance import PatternModel, far_band
from nearfar.estimate.any_patterns.neighbours import REACH
from nearfar.estimate.any_patterns.sweep import COMPONENTS, PatternRows
from nearfar.plan.patterns import Shown
from nearfar.plan.recognition.contents import Uniform
from nearfar.progress import Report, ignore_progress
from nearfar.release import version
from nearfar.transport.model import Transport
from nearfar.transport.posterior import PatternPosterior
from nearfar.transport.quality import Quality
from nearfar.transport.store import save_transport
from nearfar.transport.verdict import KeptVerdict, Reason
from nearfar.workflow.by_codes import AXES, correspond_by_codes
from nearfar.workflow.pattern_faults import find_turns, sums_of_pairs
from nearfar.workflow.reconstruction.summary import description_of
from nearfar.workflow.verdict.by_patterns import compare_with_photos
from nearfar.workflow.verdict.checked import CheckedLight, Judged, Reconstructed
from nearfar.workflow.verdict.verdict import judge

# Photos with which the matrices of a camera pixel still take milliseconds, and projector pixels for
# which the patterns of that many photos fit in memory.
MOST_PHOTOS = 1000
MOST_PROJECTOR_PIXELS = 128**2
# Share of the photos that are held out, and fewest; they are chosen evenly.
HELD_OUT_SHARE = 0.04
FEWEST_HELD_OUT = 2
# Patches of camera pixels that are estimated without them, and the side of each.
PATCHES_ALONG = 3
PATCH_SIDE = 10
# Arrays of a camera pixel that are held at once, over those of its transport.
COPIES = 3
# By their causes, reasons that may be mere consequences of another fault of the photos.
CONSEQUENCES = {
    "unknown": "photos of inverse patterns do not sum to one white",
    "too-few-photos": "too little seems to be measured",
    "noise": "the photos seem noisy",
    "model": "the scene seems to have light that the model cannot represent",
}


class _Data(NamedTuple):
    """All that the estimate is made from."""

    photos: Floats
    patterns: Floats
    places: Floats  # (C, 2)


def reconstruct_from_patterns(
    capture: Capture,
    correspondence: Correspondence | None = None,
    *,
    memory: int = 2 * 10**9,
    progress: Report = ignore_progress,
) -> Transport:
    """Estimate the transport from photos of patterns that are known by their levels alone.

    Parameters
    ----------
    capture : Capture
        Of a plan with offset "shown".
    correspondence, memory, progress
        As `nearfar.workflow.free_rows.reconstruct_free_rows`; q is found by
        `nearfar.workflow.by_codes` where it is not given.

    Returns
    -------
    Transport
        With a verdict by photos that were held out from the estimate of a sample of camera pixels.

    Raises
    ------
    InputError
        If the patterns are too many, too large or in colour, do not tell q, or the estimate takes
        more memory.
    """
    return _reconstruct(capture, correspondence, memory, progress)[0]


def reconstruct_from_patterns_to_file(
    capture: Capture,
    output: Path,
    correspondence: Correspondence | None = None,
    *,
    memory: int = 2 * 10**9,
    force: bool = False,
    progress: Report = ignore_progress,
) -> Reconstructed:
    """Do as `reconstruct_from_patterns`, into a file.

    Returns
    -------
    Reconstructed

    Raises
    ------
    InputError
        As `reconstruct_from_patterns`.
    ExistingOutputError, MissingFileError, StorageError
        As `nearfar.files.new_output`.
    """
    transport, judged = _reconstruct(capture, correspondence, memory, progress)
    save_transport(transport, output, force=force)
    return Reconstructed(
        judged,
        f"{capture.camera} camera pixels, {transport.lit.mean():.1%} directly lit",
        tuple(find_turns(transport.correspondence)),
    )


def _reconstruct(
    capture: Capture, correspondence: Correspondence | None, memory: int, progress: Report
) -> tuple[Transport, Judged]:
    _require_small(capture, memory)
    confidence, places, faults = _places(capture, correspondence, progress)
    data = _read(capture, places)
    faults += sums_of_pairs(capture)
    judged = _judge(capture, data, progress)
    judged = judged._replace(verdict=_with_faults(judged.verdict, faults))
    plan = capture.plan
    model, rows = estimate_from_patterns(
        *data,
        capture.camera,
        plan.projector,
        plan.window,
        lambda share: progress("estimate", share),
    )
    transport = replace(
        _as_transport(data, model, rows, capture.camera),
        provenance=_provenance(capture),
        quality=Quality(confidence, _saturated(data).reshape(capture.camera)),
        verdict=judged.verdict,
    )
    return transport, judged


def _require_small(capture: Capture, memory: int) -> None:
    plan, pixels = capture.plan, capture.plan.projector.pixels
    if capture.shown is not None and capture.shown.ndim == 4:
        raise InputError(
            f"{capture.path} has colour patterns, which tell q, and no transport, as a channel of "
            f"the camera may see several colours of the projector: shoot grey patterns, such as "
            f"those of red, green and blue one after the other, and give q of these photos as "
            f"`correspondence` if the grey ones do not tell it."
        )
    if pixels > MOST_PROJECTOR_PIXELS:
        raise InputError(
            f"{capture.path} has patterns of {plan.projector}, and the transport of anybody's "
            f"patterns is estimated on grids of up to {MOST_PROJECTOR_PIXELS} pixels: give the "
            f"patterns as pictures of their own grid, a pixel for each block of the screen."
        )
    if len(plan.patterns) > MOST_PHOTOS:
        raise InputError(
            f"{capture.path} has {len(plan.patterns)} photos, and at most {MOST_PHOTOS} are "
            f"estimated from: choose an output that ends in .npy, which takes a complete set."
        )
    values = len(plan.patterns) + plan.window**2 + far_band(plan.projector).pixels
    needed = COPIES * 4 * capture.camera.pixels * capture.channels * values
    if needed > memory:
        raise InputError(
            f"{capture.path} needs {needed / 1e9:.2g} GB at {capture.camera} camera pixels: allow "
            f"it by `memory`."
        )


def _places(
    capture: Capture, given: Correspondence | None, progress: Report
) -> tuple[Floats, Floats, list[Reason]]:
    """Return confidence (Cy, Cx), the most probable q, (C, 2), and what is wrong with photos."""
    if given is not None:
        return given.confidence, given.q.reshape(-1, 2), []
    found = correspond_by_codes(capture, progress)
    places = found.places.reshape(-1, 2)
    if unknown := [name for name in AXES if name not in found.axes]:
        raise InputError(
            f"the patterns of {capture.path} tell no {unknown[0]} apart, and a transport needs "
            f"both axes: add patterns, or give `correspondence`."
        )
    return found.correspondence.confidence, places, found.faults()


def _read(capture: Capture, places: Floats) -> _Data:
    photos = capture.read(slice(None))
    count = len(photos)
    patterns = np.stack([capture.pattern(number).ravel() for number in range(count)])
    values = np.moveaxis(photos.reshape(count, capture.camera.pixels, -1), 0, 2)
    return _Data(np.ascontiguousarray(values), patterns, places)


def _with_faults(verdict: KeptVerdict, faults: Sequence[Reason]) -> KeptVerdict:
    """Return a verdict with faults of the photos, which held-out ones share, as first reasons.

    What may be no more than a consequence of them is no cause beside them, and is told with the
    first.
    """
    if not faults:
        return verdict
    first, *rest = faults
    named = {fault.cause for fault in faults}
    others = [*rest, *(reason for reason in verdict.reasons if reason.cause not in named)]
    for reason in others:
        if (seen := CONSEQUENCES.get(reason.cause)) is not None:
            first = first._replace(sentence=f"{first.sentence} That {seen} may follow from it.")
    causes = (reason for reason in others if reason.cause not in CONSEQUENCES)
    is_wrong = verdict.grade == "wrong" or "order" in named
    return replace(
        verdict,
        grade="wrong" if is_wrong else "doubtful",
        reasons=(first, *causes),
    )


def _judge(capture: Capture, data: _Data, progress: Report) -> Judged:
    """Judge an estimate of some camera pixels by photos that it does not see."""
    held_out = _held_out(capture.plan.patterns)
    kept = np.setdiff1d(np.arange(len(data.patterns)), held_out)
    pixels, camera, inner = _patches(capture.camera)
    some = _Data(data.photos[pixels][..., kept], data.patterns[kept], data.places[pixels])
    model, rows = estimate_from_patterns(
        *some,
        camera,
        capture.plan.projector,
        capture.plan.window,
        lambda share: progress("held-out photos", share),
    )
    compared = compare_with_photos(
        _as_transport(some, model, rows, camera),
        data.patterns[held_out],
        data.photos[pixels][..., held_out],
        inner & ~_saturated(some),
        [capture.plan.patterns[number].description for number in held_out],
    )
    lights = (
        CheckedLight(int(photo), light.snr, light.expected_snr)
        for photo, light in zip(held_out, compared.lights, strict=True)
    )
    return Judged(judge(compared, ()).kept, tuple(lights))


def _patches(camera: Size) -> tuple[Integers, Size, Booleans]:
    """Choose patches of camera pixels, one below the other, evenly over the camera.

    Returns
    -------
    pixels : ndarray of int, shape (C,)
    camera : Size
        Of the patches together.
    inner : ndarray of bool, shape (C,)
        Those all of whose neighbours that count are neighbours in the camera too.
    """
    side = Size(*(min(PATCH_SIDE, length) for length in camera))
    numbers = np.arange(camera.pixels).reshape(camera)
    spans = [
        np.linspace(0, length - part, PATCHES_ALONG)
        for length, part in zip(camera, side, strict=True)
    ]
    corners = sorted({(round(y), round(x)) for y in spans[0] for x in spans[1]})
    patches = [numbers[y : y + side.height, x : x + side.width] for y, x in corners]
    inner = np.zeros(side, dtype=np.bool_)
    rim = [REACH if part < length else 0 for part, length in zip(side, camera, strict=True)]
    inner[rim[0] : side.height - rim[0], rim[1] : side.width - rim[1]] = True
    whole = Size(len(patches) * side.height, side.width)
    return np.concatenate(patches).ravel(), whole, np.tile(inner, (len(patches), 1)).ravel()


def _held_out(patterns: Sequence[object]) -> Integers:
    """Return the photos to hold out, evenly among those whose patterns are not uniform."""
    structured = np.array(
        [
            i
            for i, pattern in enumerate(patterns)
            if not (isinstance(pattern, Shown) and isinstance(pattern.content, Uniform))
        ]
    )
    count = max(FEWEST_HELD_OUT, round(HELD_OUT_SHARE * len(structured)))
    places = np.linspace(0, len(structured) - 1, count + 2).round().astype(int)[1:-1]
    return np.asarray(structured[places])


def _lit_places(rows: PatternRows, places: Floats) -> Floats:
    q = places.astype(np.float32).copy()
    q[~rows.lit] = np.nan
    return q


def _saturated(data: _Data) -> Booleans:
    return np.asarray(data.photos.max(axis=(1, 2)) >= 1.0)


def _as_transport(data: _Data, model: PatternModel, rows: PatternRows, camera: Size) -> Transport:
    shape = (*camera, rows.direct.shape[1])
    return Transport(
        projector=model.projector,
        correspondence=_lit_places(rows, data.places).reshape(*camera, 2),
        direct=rows.direct.reshape(shape),
        near=rows.near.reshape(*shape, model.window, model.window),
        far=rows.far.reshape(*shape, -1),
        far_basis=model.far_basis,
        black=rows.black.reshape(shape),
        noise=rows.noise.reshape(shape),
        posterior=PatternPosterior(
            COMPONENTS,
            model.patterns,
            rows.component.reshape(camera),
            rows.ratio.reshape(camera),
            rows.black_deviation.reshape(shape),
        ),
    )


def _provenance(capture: Capture) -> dict[str, Any]:
    return {
        "nearfar": version(),
        "method": "patterns",
        "square": False,
        **description_of(capture),
        "drift": None,
        "excess_of_sums": 0.0,
        "rounding": 0.0,
    }
