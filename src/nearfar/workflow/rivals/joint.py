"""The joint estimate from a plan chosen for the budget; correspondence comes from the same photos.

The plan expects the noise of photos of that exposure.
"""

from collections.abc import Iterator

import numpy as np

from nearfar.correspondence import correspond_by_phase
from nearfar.estimate.joint import estimate_jointly
from nearfar.photometry.measure import measure
from nearfar.plan import choose_plan
from nearfar.plan.choose_frequencies import NOISE
from nearfar.workflow.acquire import acquire_in_memory
from nearfar.workflow.rivals.bench import Bench
from nearfar.workflow.rivals.rival import Attempt, Budget, Rival


def _attempts(bench: Bench, budget: Budget) -> Iterator[Attempt]:
    noise = NOISE / np.sqrt(budget.exposure(budget.photos))
    projector = bench.scene.projector
    plan, _ = choose_plan(projector, budget.photos, window=bench.window, noise=float(noise))
    photos = len(plan.patterns)
    measurements = measure(acquire_in_memory(plan, bench.rig(budget.exposure(photos))))
    q = correspond_by_phase(measurements, pitch=plan.pitch).q
    yield Attempt(
        photos, estimate_jointly(measurements, q, plan.window, plan.far, pitch=plan.pitch)
    )


JOINT = Rival(
    title="joint, no stripes",
    assumes="a row is direct light about one projector pixel, smooth light near it, and far light "
    "that is likely to be of low frequencies",
    line={"color": "#1f4e9c", "marker": "o", "linestyle": "-"},
    attempts=_attempts,
)
