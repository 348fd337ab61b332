"""The paper's estimation as an estimator: which plans it takes, and its memory."""

from collections.abc import Callable

from nearfar.arrays import Floats
from nearfar.devices import Device
from nearfar.errors import PlanError
from nearfar.estimate.base import Estimator, Memory, Model
from nearfar.estimate.paper import estimate
from nearfar.illumination.frequencies import CHECKERBOARD, far_frequencies, near_frequencies
from nearfar.photometry.measure import measured_frequencies
from nearfar.photometry.measurements import Measurements
from nearfar.plan import Plan
from nearfar.transport.model import Transport

FLOAT32_BYTES = 4


class PaperEstimator(Estimator):
    """Direct, then near-range, then far-range, each camera pixel by itself (sections 4.1 to 4.3).

    It needs a plan made with a near window and a far band, all frequencies of both.
    """

    def require(self, plan: Plan) -> None:
        """Refuse a plan that lacks a frequency of the near window or of the far band."""
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
                f"the plan of this capture is not the paper's: {len(missing)} of its frequencies "
                f"were not shot, ({missing[0].fy}, {missing[0].fx}) first; plan with `window` "
                f"and `far`."
            )

    def memory(self, plan: Plan, channels: int) -> Memory:
        """Count the W^2 x W^2 matrix of all, and each camera pixel's responses and windows."""
        photos, entries = len(plan.patterns), plan.window**2
        # Differences and sums of the pairs, responses, windows.
        each = channels * (2 * photos + 2 * entries)
        return Memory(FLOAT32_BYTES * entries**2, FLOAT32_BYTES * each)

    def estimate(
        self,
        measurements: Measurements,
        q: Floats,
        model: Model,
        *,
        device: Device = "cpu",
        progress: Callable[[float], None] | None = None,
    ) -> Transport:
        """Estimate as the paper does; see `nearfar.estimate.paper.estimate`."""
        pixels = measurements.camera.pixels

        def report(done: int) -> None:
            if progress is not None:
                progress(done / pixels)

        return estimate(
            measurements,
            q,
            model.window,
            model.far,
            model.dropped,
            device=device,
            progress=report,
        )


PAPER = PaperEstimator()
