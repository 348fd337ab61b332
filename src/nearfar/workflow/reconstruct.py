"""From a capture to a transport."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any, Literal, NamedTuple

import numpy as np

from nearfar.arrays import Floats, blocks
from nearfar.capture import Capture
from nearfar.correspondence import (
    Correspondence,
    correspond_by_phase,
    correspond_by_stripes,
    has_stripes,
    onto_projector,
)
from nearfar.errors import InputError, PlanError
from nearfar.estimate.joint import estimate_jointly
from nearfar.estimate.paper import estimate
from nearfar.illumination.frequencies import CHECKERBOARD, far_frequencies, near_frequencies
from nearfar.photometry.drift import find_references
from nearfar.photometry.measure import measure, measured_frequencies
from nearfar.photometry.measurements import Measurements, join
from nearfar.photometry.photos import Photos
from nearfar.photometry.steady import SteadyPhotos, steady
from nearfar.plan import Plan
from nearfar.transport.model import Transport
from nearfar.version import version

# Bytes of photos and answers held at once while measuring.
HELD = 2**29

Progress = Callable[[str, float], None]
Method = Literal["joint", "paper"]


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
        If there is no correspondence to be had, no light in the photos, or the plan by reference
        has too few whites and blacks.
    """
    report = progress or (lambda _what, _share: None)
    estimator = _ESTIMATORS[method]
    estimator.require(capture.plan)
    photos = _without_drift(capture, report)
    if correspondence is None and has_stripes(photos.plan):
        correspondence = _by_stripes(photos, report)
    whole: Measurements | None = None
    if correspondence is None or estimator.wants_all or square:
        measured = [measure(photos, rows) for rows in _row_blocks(photos, report, "measuring")]
        whole = join(measured)
    if correspondence is None:
        assert whole is not None
        correspondence = _by_phase(whole, str(capture.path))
    if not correspondence.lit.any():
        raise InputError(
            f"{capture.path} shows no direct light at any camera pixel: check that the camera "
            f"sees the projector's light, or give --correspondence Q.npy."
        )
    pixels = correspondence.pixels
    excesses: list[float] = []

    def estimated(rows: slice) -> Transport:
        measurements = measure(photos, rows)
        excesses.append(measurements.excess_of_sums)
        return estimator.estimate(photos.plan, measurements, pixels[rows], lambda _share: None)

    if whole is None:
        transport = _stacked(
            [estimated(rows) for rows in _row_blocks(photos, report, "reconstructing")]
        )
    else:
        excesses.append(whole.excess_of_sums)
        if square:
            whole, pixels = onto_projector([whole], correspondence)
        transport = estimator.estimate(
            photos.plan, whole, pixels, lambda share: report("reconstructing", share)
        )
    provenance = _provenance(capture, photos, method=method, square=square)
    provenance["excess_of_sums"] = max(excesses, key=abs)
    return replace(transport, provenance=provenance), correspondence


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


def _by_stripes(photos: Photos, report: Progress) -> Correspondence:
    found = [
        correspond_by_stripes(photos, rows)
        for rows in _row_blocks(photos, report, "correspondence")
    ]
    return Correspondence(
        np.concatenate([part.pixels for part in found]),
        np.concatenate([part.confidence for part in found]),
    )


def _row_blocks(photos: Photos, report: Progress, what: str) -> Iterator[slice]:
    """Cut the camera into blocks of rows of which the photos fit in memory."""
    row = 4 * len(photos.plan.patterns) * photos.camera.width * photos.channels
    for rows in blocks(photos.camera.height, HELD // row):
        yield rows
        report(what, rows.stop / photos.camera.height)


Shares = Callable[[float], None]


def _as_the_paper(
    plan: Plan, measurements: Measurements, pixels: Floats, _progress: Shares
) -> Transport:
    return estimate(measurements, pixels, plan.window, plan.far, plan.dropped)


def _jointly(plan: Plan, measurements: Measurements, pixels: Floats, progress: Shares) -> Transport:
    return estimate_jointly(measurements, pixels, plan.window, plan.far, progress=progress)


class _Estimator(NamedTuple):
    """What plan a method takes, what it makes of measurements and q, and of how many at once."""

    require: Callable[[Plan], None]
    estimate: Callable[[Plan, Measurements, Floats, Shares], Transport]
    wants_all: bool


_ESTIMATORS: dict[Method, _Estimator] = {
    "paper": _Estimator(require_paper_plan, _as_the_paper, wants_all=False),
    # Neighbours share what they know.
    "joint": _Estimator(_require_photos, _jointly, wants_all=True),
}


def _stacked(pieces: Sequence[Transport]) -> Transport:
    """Put blocks of camera rows together."""

    def joined(name: str) -> Any:
        return np.concatenate([getattr(piece, name) for piece in pieces])

    if len(pieces) == 1:
        return pieces[0]
    return replace(
        pieces[0],
        correspondence=joined("correspondence"),
        direct=joined("direct"),
        near=joined("near"),
        far=joined("far"),
        black=joined("black"),
        noise=joined("noise"),
    )


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
