"""Parallel single-pixel imaging, by `nearfar.baselines.parallel_single_pixel`.

Few sinusoids to find reception fields leave photos for larger windows, many find them better: of
three numbers, and of 3 and 4 phases, the best counts.
"""

from collections.abc import Iterator
from itertools import product

from nearfar.arrays import Size
from nearfar.baselines.parallel_single_pixel import parallel_single_pixel
from nearfar.workflow.rivals.bench import Bench
from nearfar.workflow.rivals.rival import Attempt, Budget, Rival

# Projector pixels for each sinusoid that finds reception fields.
PIXELS_PER_PERIOD = (16, 8, 5)
STEPS = (3, 4)


def _attempts(bench: Bench, budget: Budget) -> Iterator[Attempt]:
    height, width = bench.scene.projector
    for pixels, steps in product(PIXELS_PER_PERIOD, STEPS):
        # A single row or column is its own projection.
        periods = Size(*(min(max(1, side // pixels), (side - 1) // 2) for side in (height, width)))
        shooting = bench.shooting(budget)
        found = parallel_single_pixel(shooting, periods=periods, steps=steps)
        if found is not None:
            yield Attempt(shooting.taken, found, bench.exposure_of(budget, shooting))


PARALLEL_SINGLE_PIXEL = Rival(
    title="parallel single-pixel",
    assumes="each camera pixel is lit from a small part of the projector",
    line={"color": "#1d8aa3", "marker": "p", "linestyle": "-."},
    attempts=_attempts,
    is_dense=True,
)
