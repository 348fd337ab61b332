"""Compressive light transport: random patterns, with the regularisation nearest to the truth."""

import time
from collections.abc import Callable, Iterator

from nearfar.baselines.choosing import best_share
from nearfar.baselines.compressive import (
    ROWS_TIMED,
    estimate_seconds,
    reconstruct_compressive,
)
from nearfar.baselines.random_patterns import bernoulli_patterns, measure_by_rig
from nearfar.progress import duration
from nearfar.workflow.rivals.bench import Bench
from nearfar.workflow.rivals.rival import Attempt, Budget, Rival

# Of a budget's work, about the share that the choice of lambda takes.
SHARE_OF_CHOOSING = 0.2
# For fewer camera pixels the estimate would take as long as the work.
FEWEST_TO_ESTIMATE = 8 * ROWS_TIMED
# What ends sooner is not announced.
SECONDS_TO_ANNOUNCE = 15.0
TITLE = "compressive (CLT)"


def _attempts(bench: Bench, budget: Budget) -> Iterator[Attempt]:
    # One photo is of black.
    patterns = bernoulli_patterns(bench.scene.projector, budget.photos - 1, 0)
    measurements = measure_by_rig(bench.rig(budget.exposure(budget.photos)), patterns)
    choice = best_share(
        measurements,
        bench.matrices,
        exposure=bench.gain,
        progress=_telling_of_long_choices(bench, budget),
    )
    if len(measurements.responses) >= FEWEST_TO_ESTIMATE:
        seconds = estimate_seconds(measurements, choice.share, refitted=choice.is_refitted)
        if seconds >= SECONDS_TO_ANNOUNCE:
            bench.note(
                f"{TITLE}, {budget.photos} photos: the Lasso of {len(measurements.rows)} rows "
                f"takes about {duration(seconds)}"
            )
    found = reconstruct_compressive(
        measurements,
        choice.share,
        refitted=choice.is_refitted,
        progress=lambda share: bench.progress(SHARE_OF_CHOOSING + (1 - SHARE_OF_CHOOSING) * share),
    )
    yield Attempt(measurements.photos, found)


def _telling_of_long_choices(bench: Bench, budget: Budget) -> Callable[[float], None]:
    """Return a callback of the choice of lambda that says once if the choice takes long."""
    begun, said = time.monotonic(), False

    def tell(share: float) -> None:
        nonlocal said
        bench.progress(SHARE_OF_CHOOSING * share)
        passed = time.monotonic() - begun
        # How long a value takes grows as lambda falls, by how much only the photos tell.
        if passed >= SECONDS_TO_ANNOUNCE and not said:
            said = True
            bench.note(
                f"{TITLE}, {budget.photos} photos: choosing the regularisation has taken "
                f"{duration(passed)} for {share:.0%} of its values, and may take several times as "
                f"long"
            )

    return tell


COMPRESSIVE = Rival(
    title=TITLE,
    assumes="a row is sparse in Haar wavelets",
    line={"color": "#c2561a", "marker": "^", "linestyle": "-."},
    attempts=_attempts,
    is_dense=True,
)
