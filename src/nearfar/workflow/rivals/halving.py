"""Attempts of methods that halve a limit of light while photos are left: several first limits."""

from collections.abc import Callable, Iterator, Sequence

from nearfar.baselines.shooting import Shooting
from nearfar.workflow.rivals.bench import Bench
from nearfar.workflow.rivals.rival import Attempt, Budget, Relights


def attempts_from(
    method: Callable[[Shooting, float], Relights], limits: Sequence[float], fewest: int
) -> Callable[[Bench, Budget], Iterator[Attempt]]:
    """Return a rival's attempts: one for each limit, with photos of its own.

    Parameters
    ----------
    method : callable
        From photos and the first limit to a transport.
    limits : sequence of float
        In photo units.
    fewest : int
        Photos that the method needs; a smaller budget gets no attempt.
    """

    def attempts(bench: Bench, budget: Budget) -> Iterator[Attempt]:
        if budget.photos < fewest:
            return
        for number, limit in enumerate(limits, 1):
            shooting = bench.shooting(budget)
            found = method(shooting, limit)
            yield Attempt(shooting.taken, found, bench.exposure_of(budget, shooting))
            bench.progress(number / len(limits))

    return attempts
