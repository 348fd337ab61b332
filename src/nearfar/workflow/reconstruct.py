"""From a capture to a transport."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, Literal, NamedTuple

import numpy as np

from nearfar.arrays import Floats, blocks
from nearfar.capture import Capture, white_and_black
from nearfar.correspondence import (
    Correspondence,
    correspond_by_phase,
    correspond_by_stripes,
    has_stripes,
    onto_projector,
)
from nearfar.errors import InputError, PlanError
from nearfar.estimate.joint import estimate_jointly
from nearfar.estimate.joint.estimate import TURNS
from nearfar.estimate.joint.prior import RATIOS
from nearfar.estimate.paper import estimate
from nearfar.illumination.frequencies import CHECKERBOARD, far_frequencies, near_frequencies
from nearfar.photometry.drift import find_references
from nearfar.photometry.measure import measure, measured_frequencies
from nearfar.photometry.measurements import Measurements, join
from nearfar.photometry.photos import Photos
from nearfar.photometry.steady import SteadyPhotos, steady
from nearfar.plan import Plan
from nearfar.transport.kinds import LIT, UNLIT
from nearfar.transport.model import Transport
from nearfar.transport.rows import of_rows, stacked
from nearfar.version import version

# Bytes of memory that a reconstruction takes at most, unless told otherwise.
MEMORY = 2 * 10**9
# What Python and the libraries take of them.
LIBRARIES = 3 * 10**8
# What arrays that come and go add to those that are counted.
SLACK = 1.5

Progress = Callable[[str, float], None]
Method = Literal["joint", "paper"]


class Part(NamedTuple):
    """Some rows of the camera, reconstructed."""

    transport: Transport
    correspondence: Correspondence


def require_paper_plan(plan: Plan) -> None:
    """Refuse a plan that lacks a photo the paper's estimation needs.

    Raises
    ------
    PlanError
    """
    plan.require_real("reconstruct")
    shot = measured_frequencies(plan)
    wanted = [
        CHECKERBOARD,
        *far_frequencies(plan.far, plan.projector),
        *near_frequencies(plan.window, plan.dropped),
    ]
    missing = [k for k in wanted if k not in shot and -k not in shot]
    if missing:
        raise PlanError(
            f"the plan of this capture is not the paper's: {len(missing)} of its frequencies were "
            f"not shot, ({missing[0].fy}, {missing[0].fx}) first; plan with --near and --far."
        )


def _require_photos(plan: Plan) -> None:
    plan.require_real("reconstruct")
    measured_frequencies(plan)


def reconstruct(
    capture: Capture,
    correspondence: Correspondence | None = None,
    *,
    method: Method = "joint",
    square: bool = False,
    memory: int = MEMORY,
    progress: Progress | None = None,
) -> tuple[Transport, Correspondence]:
    """Reconstruct the transport of a capture.

    Parameters
    ----------
    capture : Capture
    correspondence : Correspondence, optional
        By default from the capture's stripes, or without them by phase.
    method : {"joint", "paper"}
        Estimator.
    square : bool
        The paper's square T: average the camera pixels that one projector pixel lights.
    memory : int
        Bytes to work in, above what is returned. The camera is cut into blocks of rows; a square
        T takes what it needs.
    progress : callable, optional
        Told what is being done and the share done, 0 to 1.

    Returns
    -------
    transport : Transport
    correspondence : Correspondence
        As given or found, at the camera's own resolution.

    Raises
    ------
    PlanError
        If the plan's patterns are complex, or not the paper's for its method.
    InputError
        If there is no correspondence to be had, no light in the photos, the plan by reference
        has too few whites and blacks, or a row of the camera does not fit in the memory.
    """
    if square:
        return _squarely(capture, correspondence, method, progress or _unheard)
    parts = list(
        reconstruct_in_blocks(
            capture, correspondence, method=method, memory=memory, progress=progress
        )
    )
    return stacked([part.transport for part in parts]), Correspondence(
        np.concatenate([part.correspondence.pixels for part in parts]),
        np.concatenate([part.correspondence.confidence for part in parts]),
    )


def reconstruct_in_blocks(
    capture: Capture,
    correspondence: Correspondence | None = None,
    *,
    method: Method = "joint",
    memory: int = MEMORY,
    progress: Progress | None = None,
) -> Iterator[Part]:
    """Reconstruct block by block of camera rows, each when it is asked for; see `reconstruct`.

    What neighbours tell each other across the border of two blocks is computed for both, so a
    block does not depend on how the rest of the camera is cut but for two things that are taken
    over its own rows: the noise model of inverse pairs, and what is a usual step of q (which way
    round surfaces are seen, in correspondence by phase).

    Yields
    ------
    Part
        In order. The provenance of the last one is the whole camera's.
    """
    report = progress or _unheard
    estimator = _ESTIMATORS[method]
    estimator.require(capture.plan)
    photos = _without_drift(capture, report)
    by_phase = correspondence is None and not has_stripes(photos.plan)
    rows = _rows_at_once(photos, estimator, memory)
    if correspondence is None and not by_phase:
        correspondence = _by_stripes(photos, rows, report)
    if correspondence is not None and not correspondence.lit.any():
        raise _without_light(capture)
    height, excess, lit = photos.camera.height, 0.0, False
    brightest = _brightest_white(photos)
    # Seeing which way round q runs takes a row more than the neighbours' own estimates.
    halo = estimator.halo + (1 if by_phase else 0)
    for block in blocks(height, rows):
        whole = slice(max(0, block.start - halo), min(height, block.stop + halo))
        core = slice(block.start - whole.start, block.stop - whole.start)
        measurements = replace(measure(photos, whole), brightest=brightest)
        if correspondence is None:
            found = _by_phase(measurements, str(capture.path))
        else:
            found = Correspondence(correspondence.pixels[whole], correspondence.confidence[whole])
        excess = max(excess, measurements.excess_of_sums, key=abs)

        def done(share: float, block: slice = block) -> None:
            report("reconstructing", (block.start + share * (block.stop - block.start)) / height)

        transport = estimator.estimate(photos.plan, measurements, found.pixels, done)
        mine = Correspondence(found.pixels[core], found.confidence[core])
        lit = lit or bool(mine.lit.any())
        if block.stop == height and not lit:
            raise _without_light(capture)
        provenance = _provenance(capture, photos, method=method, square=False)
        provenance["excess_of_sums"] = excess
        yield Part(replace(of_rows(transport, core), provenance=provenance), mine)
        report("reconstructing", block.stop / height)


def _squarely(
    capture: Capture, correspondence: Correspondence | None, method: Method, report: Progress
) -> tuple[Transport, Correspondence]:
    """Reconstruct the paper's square T, all of it at once."""
    estimator = _ESTIMATORS[method]
    estimator.require(capture.plan)
    photos = _without_drift(capture, report)
    rows = _rows_at_once(photos, estimator, MEMORY)
    measured = []
    for block in blocks(photos.camera.height, rows):
        measured.append(measure(photos, block))
        report("measuring", block.stop / photos.camera.height)
    if correspondence is None and has_stripes(photos.plan):
        correspondence = _by_stripes(photos, rows, report)
    elif correspondence is None:
        correspondence = _by_phase(join(measured), str(capture.path))
    if not correspondence.lit.any():
        raise _without_light(capture)
    whole, pixels = onto_projector(measured, correspondence)
    transport = estimator.estimate(
        photos.plan, whole, pixels, lambda share: report("reconstructing", share)
    )
    provenance = _provenance(capture, photos, method=method, square=True)
    provenance["excess_of_sums"] = max((part.excess_of_sums for part in measured), key=abs)
    return replace(transport, provenance=provenance), correspondence


def _unheard(_what: str, _share: float) -> None:
    """Take reports that nobody asked for."""


def _without_light(capture: Capture) -> InputError:
    return InputError(
        f"{capture.path} shows no direct light at any camera pixel: check that the camera "
        f"sees the projector's light, or give --correspondence Q.npy."
    )


def _brightest_white(photos: Photos) -> float:
    """Largest white less black of the whole camera."""
    found = white_and_black(photos.plan)
    if found is None:
        return 0.0
    row = 8 * photos.camera.width * photos.channels
    brightest = 0.0
    for rows in blocks(photos.camera.height, 2**26 // row):
        white, black = photos.read(list(found), rows)
        brightest = max(brightest, float((white - black).max()))
    return brightest


def _rows_at_once(photos: Photos, estimator: "_Estimator", memory: int) -> int:
    """Tell how many rows of the camera may be worked at in so many bytes.

    Raises
    ------
    InputError
        If not even one fits.
    """
    shared, pixel = estimator.bytes_of(photos.plan, photos.channels)
    row = SLACK * pixel * photos.camera.width
    # One more for correspondence by phase.
    beside = 2 * (estimator.halo + 1) if estimator.halo else 0
    rows = int((memory - LIBRARIES - shared) / row) - beside
    if rows < 1 and rows + beside < photos.camera.height:
        least = LIBRARIES + shared + row * min(beside + 1, photos.camera.height)
        raise InputError(
            f"{memory / 1e6:.0f} MB of memory are too few for one row of these photos: give "
            f"--memory {np.ceil(least / 1e8) / 10:.1f}GB or more."
        )
    return max(rows, 1) if rows + beside < photos.camera.height else photos.camera.height


def _without_drift(capture: Capture, report: Progress) -> Photos:
    """Read a capture by reference without the drift of lamp and ambient; others as they are."""
    if capture.plan.offset != "reference":
        return capture
    whites, blacks = find_references(capture.plan)
    total = 2 * (len(whites) + len(blacks))
    return steady(capture, lambda done: report("references", done / total))


def _by_phase(measurements: Measurements, source: str) -> Correspondence:
    """Find the correspondence in the photos of transport themselves.

    Raises
    ------
    InputError
        If the frequencies that were measured cannot settle it.
    """
    try:
        return correspond_by_phase(measurements)
    except InputError as error:
        reason = str(error).rstrip(".")
        raise InputError(f"{source}: {reason}, or give --correspondence Q.npy.") from None


def _by_stripes(photos: Photos, rows: int, report: Progress) -> Correspondence:
    found = []
    for block in blocks(photos.camera.height, rows):
        found.append(correspond_by_stripes(photos, block))
        report("correspondence", block.stop / photos.camera.height)
    return Correspondence(
        np.concatenate([part.pixels for part in found]),
        np.concatenate([part.confidence for part in found]),
    )


Shares = Callable[[float], None]


def _as_the_paper(
    plan: Plan, measurements: Measurements, pixels: Floats, _progress: Shares
) -> Transport:
    return estimate(measurements, pixels, plan.window, plan.far, plan.dropped)


def _jointly(plan: Plan, measurements: Measurements, pixels: Floats, progress: Shares) -> Transport:
    return estimate_jointly(measurements, pixels, plan.window, plan.far, progress=progress)


def _bytes_of_paper(plan: Plan, channels: int) -> tuple[int, int]:
    photos, entries = len(plan.patterns), plan.window**2
    # Differences and sums of the pairs, answers, windows.
    return 4 * entries**2, 4 * channels * (2 * photos + 2 * entries)


def _bytes_of_joint(plan: Plan, channels: int) -> tuple[int, int]:
    answers = 2 * len(measured_frequencies(plan))
    entries = plan.window**2
    kinds = len(LIT) + len(UNLIT)
    prior = 4 * (2 * answers**2 + 2 * answers * entries + len(RATIOS) * entries + 2 * entries**2)
    # Answers, re-ordered; what a turn begins with, what neighbours expect, what it finds, the sum.
    rows = 4 * channels * (2 * answers + 4 * (answers + entries))
    # Inverse pairs are held while they are measured.
    pairs = 4 * channels * len(plan.patterns) if plan.offset == "inverse" else 0
    return kinds * prior, rows + entries + pairs


class _Estimator(NamedTuple):
    """What plan a method takes, and what it makes of measurements and q.

    Attributes
    ----------
    require : callable
    estimate : callable
    halo : int
        Rows of the camera beside those wanted that tell something of them.
    bytes_of : callable
        From a plan and a number of channels: bytes that all share, and those of a camera pixel.
    """

    require: Callable[[Plan], None]
    estimate: Callable[[Plan, Measurements, Floats, Shares], Transport]
    halo: int
    bytes_of: Callable[[Plan, int], tuple[int, int]]


_ESTIMATORS: dict[Method, _Estimator] = {
    "paper": _Estimator(require_paper_plan, _as_the_paper, 0, _bytes_of_paper),
    # Each turn but the first hears the neighbours, and the first sees their q.
    "joint": _Estimator(_require_photos, _jointly, TURNS, _bytes_of_joint),
}


def _provenance(
    capture: Capture, photos: Photos, *, method: Method, square: bool
) -> dict[str, Any]:
    plan = capture.plan
    drift = photos.drift if isinstance(photos, SteadyPhotos) else None
    return {
        "nearfar": version(),
        "method": method,
        "square": square,
        "plan": {
            "window": plan.window,
            "far": list(plan.far),
            "dropped": list(plan.dropped),
            "offset": plan.offset,
            "photos": len(plan.patterns),
        },
        "photos": {"dtype": str(capture.photos.dtype), "full_scale": capture.full_scale},
        "rig": capture.rig,
        # Shares of the mean lamp and of white, where references tell.
        "drift": drift and {"lamp": drift.lamp_range, "ambient": drift.ambient_range},
    }
