"""Adaptive dual photography, by `nearfar.baselines.adaptive_dual`; of some thresholds the best."""

from collections.abc import Iterator

from nearfar.baselines.adaptive_dual import FEWEST_PHOTOS, adaptive_dual
from nearfar.workflow.rivals.bench import Bench
from nearfar.workflow.rivals.rival import Attempt, Budget, Rival

# The first of each attempt, in photo units.
THRESHOLDS = (0.003, 0.01, 0.03, 0.1, 0.3)


def _attempts(bench: Bench, budget: Budget) -> Iterator[Attempt]:
    if budget.photos < FEWEST_PHOTOS:
        return
    for number, threshold in enumerate(THRESHOLDS):
        shooting = bench.shooting(budget)
        found = adaptive_dual(shooting, threshold)
        yield Attempt(shooting.taken, found, bench.exposure_of(budget, shooting))
        bench.progress((number + 1) / len(THRESHOLDS))


ADAPTIVE_DUAL = Rival(
    title="adaptive dual",
    assumes="each camera pixel is lit from few blocks of the projector",
    line={"color": "#6b8e23", "marker": "P", "linestyle": "-."},
    attempts=_attempts,
    is_dense=True,
)
