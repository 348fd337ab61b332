"""From a capture to a transport."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from nearfar.arrays import blocks
from nearfar.capture import Capture
from nearfar.correspondence import (
    Correspondence,
    correspond_by_stripes,
    has_stripes,
    onto_projector,
)
from nearfar.errors import InputError, PlanError
from nearfar.estimate.paper import estimate
from nearfar.illumination.frequencies import CHECKERBOARD, far_frequencies, near_frequencies
from nearfar.photometry.measure import find_pairs, measure
from nearfar.photometry.measurements import Measurements
from nearfar.plan import Plan
from nearfar.transport.model import Transport
from nearfar.version import version

# Bytes of photos and answers held at once while measuring.
HELD = 2**29

Progress = Callable[[str, float], None]


def require_paper_plan(plan: Plan) -> None:
    """Refuse a plan that lacks a photo the paper's estimation needs.

    Raises
    ------
    PlanError
    """
    plan.require_real("reconstruct")
    shot = {pair.frequency for pair in find_pairs(plan)}
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


def reconstruct(
    capture: Capture,
    correspondence: Correspondence | None = None,
    *,
    square: bool = False,
    progress: Progress | None = None,
) -> tuple[Transport, Correspondence]:
    """Reconstruct the transport of a capture as the paper does.

    Parameters
    ----------
    capture : Capture
    correspondence : Correspondence, optional
        By default from the capture's stripes.
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
        If the plan is not the paper's.
    InputError
        If there are no stripes and no correspondence, or no light in the photos.
    """
    report = progress or (lambda _what, _share: None)
    require_paper_plan(capture.plan)
    if correspondence is None:
        correspondence = _by_stripes(capture, report)
    if not correspondence.lit.any():
        raise InputError(
            f"{capture.path} shows no direct light at any camera pixel: check that the camera "
            f"sees the projector's light, or give --correspondence Q.npy."
        )
    excesses: list[float] = []

    def estimated(rows: slice) -> Transport:
        measurements = measure(capture, rows)
        excesses.append(measurements.excess_of_sums)
        return _estimate(capture.plan, measurements, correspondence.pixels[rows])

    if square:
        parts = [measure(capture, rows) for rows in _row_blocks(capture, report, "measuring")]
        measurements, pixels = onto_projector(parts, correspondence)
        excesses = [part.excess_of_sums for part in parts]
        transport = _estimate(capture.plan, measurements, pixels)
    else:
        transport = _stacked(
            [estimated(rows) for rows in _row_blocks(capture, report, "reconstructing")]
        )
    provenance = _provenance(capture, square=square)
    provenance["excess_of_sums"] = max(excesses, key=abs)
    return replace(transport, provenance=provenance), correspondence


def _by_stripes(capture: Capture, report: Progress) -> Correspondence:
    if not has_stripes(capture.plan):
        raise InputError(
            f"{capture.path} has no photos of stripes: give the correspondence with "
            f"--correspondence Q.npy."
        )
    found = [
        correspond_by_stripes(capture, rows)
        for rows in _row_blocks(capture, report, "correspondence")
    ]
    return Correspondence(
        np.concatenate([part.pixels for part in found]),
        np.concatenate([part.confidence for part in found]),
    )


def _row_blocks(capture: Capture, report: Progress, what: str) -> Iterator[slice]:
    """Cut the camera into blocks of rows of which the photos fit in memory."""
    row = 4 * len(capture.plan.patterns) * capture.camera.width * capture.channels
    for rows in blocks(capture.camera.height, HELD // row):
        yield rows
        report(what, rows.stop / capture.camera.height)


def _estimate(plan: Plan, measurements: Measurements, pixels: Any) -> Transport:
    return estimate(measurements, pixels, plan.window, plan.far, plan.dropped)


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


def _provenance(capture: Capture, *, square: bool) -> dict[str, Any]:
    plan = capture.plan
    return {
        "nearfar": version(),
        "method": "paper",
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
    }
