"""Symmetric photography, by `nearfar.baselines.symmetric`; of some tolerances the best."""

from collections.abc import Iterator

from nearfar.baselines.symmetric import FEWEST_PHOTOS, symmetric_photography
from nearfar.workflow.rivals.bench import Bench
from nearfar.workflow.rivals.coaxial import why_not_coaxial
from nearfar.workflow.rivals.rival import Attempt, Budget, Rival

# The first of each attempt, in photo units.
TOLERANCES = (0.001, 0.003, 0.01, 0.03, 0.1)


def _attempts(bench: Bench, budget: Budget) -> Iterator[Attempt]:
    if budget.photos < FEWEST_PHOTOS:
        return
    for number, tolerance in enumerate(TOLERANCES):
        shooting = bench.shooting(budget)
        found = symmetric_photography(shooting, tolerance)
        yield Attempt(shooting.taken, found, bench.exposure_of(budget, shooting))
        bench.progress((number + 1) / len(TOLERANCES))


SYMMETRIC = Rival(
    title="symmetric",
    assumes="coaxial camera, so that T is square and symmetric; far from its diagonal, blocks of "
    "T of rank one",
    line={"color": "#a8326e", "marker": "h", "linestyle": "-."},
    attempts=_attempts,
    is_dense=True,
    unsuited=why_not_coaxial,
)
