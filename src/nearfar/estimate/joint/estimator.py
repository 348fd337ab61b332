"""The joint estimate as an estimator: which plans it takes, its memory, its halo."""

from collections.abc import Callable
from dataclasses import dataclass

from nearfar.arrays import Floats
from nearfar.devices import Device
from nearfar.estimate.base import Estimator, Memory, Model
from nearfar.estimate.joint.estimate import (
    NO_CHOICES,
    ROWS_BESIDE,
    SWEEPS,
    estimate_jointly,
)
from nearfar.estimate.joint.problem import Choices
from nearfar.estimate.joint.remainder import REMAINDER_ROWS
from nearfar.illumination.near_basis import NearBasis
from nearfar.photometry.measure import measured_frequencies
from nearfar.photometry.measurements import Measurements
from nearfar.plan import Plan
from nearfar.priors.fitted import LIT_AT_PITCH, LIT_COMPONENTS, PRIOR_SCALES, UNLIT_COMPONENTS
from nearfar.priors.responses import VARIANCE_RATIOS
from nearfar.transport.model import Transport

FLOAT32_BYTES = 4
# `Memory.peak_factor` at a pitch over 1, where there are no inverse pairs.
HATS_PEAK_FACTOR = 1.2


@dataclass(frozen=True, eq=False)
class JointEstimator(Estimator):
    """Estimates direct, near- and far-range light together, from a prior and from neighbours.

    It takes any plan with a white photo and another frequency.

    Attributes
    ----------
    choices : Choices
        Prior component of each camera pixel in each sweep, where they were chosen before; see
        `nearfar.estimate.joint.choose_components`.
    """

    choices: Choices = NO_CHOICES

    @property
    def halo(self) -> int:
        """Each sweep but the first reads the neighbours; second places, theirs; the first, q.

        What neighbours have in common after the sweeps reads some more, and so does what rows
        without direct light have in common before each.
        """
        return SWEEPS + 1 + REMAINDER_ROWS

    def rows_beside(self, plan: Plan) -> int:
        """Return the halo; at a pitch of several pixels, neighbours also vote for footprints."""
        return ROWS_BESIDE if plan.pitch > 1 else self.halo

    def require(self, plan: Plan) -> None:
        """Refuse a plan of complex patterns."""
        plan.require_real("reconstruct")
        measured_frequencies(plan)

    def memory(self, plan: Plan, channels: int) -> Memory:
        """Count the matrices of every prior component, and each camera pixel's responses."""
        responses = 2 * len(measured_frequencies(plan))
        entries = NearBasis(plan.window, plan.pitch).count
        lit = LIT_COMPONENTS if plan.pitch == 1 else LIT_AT_PITCH
        components = len(lit) + len(UNLIT_COMPONENTS)
        component = (
            2 * responses**2
            + 2 * responses * entries
            + len(VARIANCE_RATIOS) * entries
            + 2 * entries**2
        )
        if plan.pitch == 1:
            # Responses, re-ordered; and four sets of rows: what a sweep starts from, what is
            # expected from neighbours, what it finds, and their sum.
            each = channels * (2 * responses + 4 * (responses + entries))
            probabilities = components * len(PRIOR_SCALES)
        else:
            # Responses, re-ordered; rows, which sweeps change in place; and of half of the camera
            # pixels what is expected, and what it leaves of the responses.
            each = channels * (4 * responses + 2 * entries)
            probabilities = 0
        # Inverse pairs are in memory while they are measured.
        pairs = channels * len(plan.patterns) if plan.offset == "inverse" else 0
        counted = Memory(
            FLOAT32_BYTES * components * component,
            FLOAT32_BYTES * (each + pairs + probabilities) + entries,
        )
        if plan.pitch > 1 and not pairs:
            # Half sweeps change rows in place, a batch at a time.
            return counted._replace(peak_factor=HATS_PEAK_FACTOR)
        return counted

    def estimate(
        self,
        measurements: Measurements,
        q: Floats,
        model: Model,
        *,
        device: Device = "cpu",
        progress: Callable[[float], None] | None = None,
    ) -> Transport:
        """Estimate jointly; see `nearfar.estimate.joint.estimate_jointly`."""
        every = slice(0, measurements.camera.height)
        return self.estimate_rows(measurements, q, model, every, device=device, progress=progress)

    def estimate_rows(
        self,
        measurements: Measurements,
        q: Floats,
        model: Model,
        rows: slice,
        *,
        device: Device = "cpu",
        progress: Callable[[float], None] | None = None,
    ) -> Transport:
        """Estimate some rows jointly; rows beside them only as far as later sweeps read them."""
        return estimate_jointly(
            measurements,
            q,
            model.window,
            model.far,
            pitch=model.pitch,
            rows=rows,
            chosen=self.choices,
            device=device,
            progress=progress,
        )


JOINT = JointEstimator()
