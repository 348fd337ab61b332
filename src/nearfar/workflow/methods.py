"""The estimators by name: what plan each takes, and what memory."""

from collections.abc import Callable
from typing import Literal, NamedTuple

from nearfar.arrays import Floats
from nearfar.devices import Device
from nearfar.errors import PlanError
from nearfar.estimate.joint import Choices, estimate_jointly
from nearfar.estimate.joint.estimate import SWEEPS
from nearfar.estimate.paper import estimate
from nearfar.illumination.frequencies import CHECKERBOARD, far_frequencies, near_frequencies
from nearfar.photometry.measure import measured_frequencies
from nearfar.photometry.measurements import Measurements
from nearfar.plan import Plan
from nearfar.priors.fitted import LIT_COMPONENTS, UNLIT_COMPONENTS
from nearfar.priors.responses import VARIANCE_RATIOS
from nearfar.transport.model import Transport

Method = Literal["joint", "paper"]
Shares = Callable[[float], None]
Estimate = Callable[[Plan, Measurements, Floats, Shares, Device], Transport]


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


def _as_the_paper(
    plan: Plan, measurements: Measurements, pixels: Floats, _progress: Shares, device: Device
) -> Transport:
    return estimate(measurements, pixels, plan.window, plan.far, plan.dropped, device=device)


def jointly(
    plan: Plan,
    measurements: Measurements,
    pixels: Floats,
    progress: Shares,
    device: Device,
    chosen: Choices = (),
) -> Transport:
    """Estimate jointly, with the plan's window and far band."""
    return estimate_jointly(
        measurements, pixels, plan.window, plan.far, chosen=chosen, device=device, progress=progress
    )


def _bytes_of_paper(plan: Plan, channels: int) -> tuple[int, int]:
    photos, entries = len(plan.patterns), plan.window**2
    # Differences and sums of the pairs, responses, windows.
    return 4 * entries**2, 4 * channels * (2 * photos + 2 * entries)


def _bytes_of_joint(plan: Plan, channels: int) -> tuple[int, int]:
    responses = 2 * len(measured_frequencies(plan))
    entries = plan.window**2
    components = len(LIT_COMPONENTS) + len(UNLIT_COMPONENTS)
    prior = 4 * (
        2 * responses**2 + 2 * responses * entries + len(VARIANCE_RATIOS) * entries + 2 * entries**2
    )
    # Responses, re-ordered; and four sets of rows: what a sweep starts from, what is expected from
    # neighbours, what it finds, and their sum.
    rows = 4 * channels * (2 * responses + 4 * (responses + entries))
    # Inverse pairs are held while they are measured.
    pairs = 4 * channels * len(plan.patterns) if plan.offset == "inverse" else 0
    return components * prior, rows + entries + pairs


class Estimator(NamedTuple):
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
    estimate: Estimate
    halo: int
    bytes_of: Callable[[Plan, int], tuple[int, int]]


ESTIMATORS: dict[Method, Estimator] = {
    "paper": Estimator(require_paper_plan, _as_the_paper, 0, _bytes_of_paper),
    # Each sweep but the first reads the neighbours, and the first reads their q.
    "joint": Estimator(_require_photos, jointly, SWEEPS, _bytes_of_joint),
}
