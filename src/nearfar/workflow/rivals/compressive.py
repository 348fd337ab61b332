"""Compressive light transport: random patterns, with the regularisation nearest to the truth."""

from collections.abc import Iterator

from nearfar.baselines.choosing import best_share
from nearfar.baselines.compressive import reconstruct_compressive
from nearfar.baselines.random_patterns import bernoulli_patterns, measure_by_rig
from nearfar.workflow.rivals.bench import Bench
from nearfar.workflow.rivals.rival import Attempt, Budget, Rival


def _attempts(bench: Bench, budget: Budget) -> Iterator[Attempt]:
    # One photo is of black.
    patterns = bernoulli_patterns(bench.scene.projector, budget.photos - 1, 0)
    measurements = measure_by_rig(bench.rig(budget.exposure(budget.photos)), patterns)
    choice = best_share(measurements, bench.scene, exposure=bench.gain)
    found = reconstruct_compressive(measurements, choice.share, refitted=choice.is_refitted)
    yield Attempt(measurements.photos, found)


COMPRESSIVE = Rival(
    title="compressive (CLT)",
    line={"color": "#c2561a", "marker": "^", "linestyle": "-."},
    attempts=_attempts,
)
