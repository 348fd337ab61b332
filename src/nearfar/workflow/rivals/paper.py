"""The paper's method: inverse pairs and stripes, with the best of several far bands."""

from collections.abc import Iterator

import numpy as np

from nearfar.arrays import Size
from nearfar.correspondence import correspond_by_stripes
from nearfar.errors import PlanError
from nearfar.estimate.paper import estimate
from nearfar.photometry.measure import measure
from nearfar.plan import Plan, paper_plan
from nearfar.plan.window import default_window
from nearfar.workflow.acquire import acquire_in_memory
from nearfar.workflow.rivals.bench import Bench
from nearfar.workflow.rivals.rival import Attempt, Budget, Rival

# Sides of the far bands that are tried, as multiples of P/W on each axis.
BAND_FACTORS = (1.0, 1.2, 2.0)
# That of the plan of which default budgets are shares.
DEFAULT_BAND_FACTOR = 1.2


def default_photos(projector: Size) -> int:
    """Return the number of photos of the paper's plan with a default window and far band."""
    window = default_window(projector)
    return len(
        paper_plan(projector, window, _far_band(projector, window, DEFAULT_BAND_FACTOR)).patterns
    )


def paper_plans(projector: Size, photos: int) -> list[Plan]:
    """List the paper's plans with the largest W that a number of photos allows, one for each band.

    Inverse pairs and stripes; empty where the photos are too few for any.
    """
    found: dict[tuple[int, Size], Plan] = {}
    for factor in BAND_FACTORS:
        for window in range(2 * ((min(projector) - 1) // 2) - 1, 2, -2):
            band = _far_band(projector, window, factor)
            # W^2 pairs at the least: no need to plan what cannot fit.
            if 2 * window**2 + sum(projector) > photos:
                continue
            try:
                plan = paper_plan(projector, window, band)
            except PlanError:
                continue
            if len(plan.patterns) <= photos:
                found[(window, band)] = plan
                break
    return list(found.values())


def _far_band(projector: Size, window: int, factor: float) -> Size:
    """Return the odd sides of a far band, `factor` times P/W on each axis."""
    return Size(
        *(
            max(1, min(2 * round((factor * side / window - 1) / 2) + 1, side - 1 + side % 2))
            for side in projector
        )
    )


def _attempts(bench: Bench, budget: Budget) -> Iterator[Attempt]:
    for plan in paper_plans(bench.scene.projector, budget.photos):
        count = len(plan.patterns)
        photos = acquire_in_memory(plan, bench.rig(budget.exposure(count)))
        q = correspond_by_stripes(photos).q
        if np.isfinite(q).any():
            found = estimate(measure(photos), q, plan.window, plan.far, plan.dropped)
            yield Attempt(count, found)


PAPER = Rival(
    title="the paper's",
    assumes="a row is direct light at one projector pixel, a window of light near it, and far "
    "light of low frequencies alone",
    line={"color": "#111111", "marker": "s", "linestyle": "--"},
    attempts=_attempts,
)
