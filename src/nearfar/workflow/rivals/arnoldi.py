"""Optical Arnoldi, by `nearfar.baselines.arnoldi`: of T, and of T less its direct light."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from nearfar.baselines.arnoldi import PHOTOS_OF_DIRECT, PHOTOS_PER_LIGHT, arnoldi
from nearfar.workflow.rivals.bench import Bench
from nearfar.workflow.rivals.coaxial import why_not_coaxial
from nearfar.workflow.rivals.rival import Attempt, Budget, Rival


def _attempts_of(*, direct_first: bool) -> Callable[[Bench, Budget], Iterator[Attempt]]:
    before = PHOTOS_OF_DIRECT if direct_first else 0

    def attempts(bench: Bench, budget: Budget) -> Iterator[Attempt]:
        lights = (budget.photos - before) // PHOTOS_PER_LIGHT
        lights = min(lights, bench.scene.projector.pixels)
        if lights < 1:
            return
        shooting = bench.shooting(budget, before + PHOTOS_PER_LIGHT * lights)
        found = arnoldi(shooting, direct_first=direct_first)
        yield Attempt(shooting.taken, found)

    return attempts


def _rival(title: str, assumes: str, line: Mapping[str, Any], *, direct_first: bool) -> Rival:
    return Rival(
        title=title,
        assumes=assumes,
        line=line,
        attempts=_attempts_of(direct_first=direct_first),
        unsuited=why_not_coaxial,
    )


ARNOLDI = _rival(
    "optical Arnoldi",
    "coaxial camera, so that T is square and symmetric; T of low rank",
    {"color": "#b0761f", "marker": "<", "linestyle": "-"},
    direct_first=False,
)
ARNOLDI_AFTER_DIRECT = _rival(
    "optical Arnoldi, D first",
    "coaxial camera, so that T is square and symmetric; T of low rank but for its diagonal",
    {"color": "#b0761f", "marker": ">", "linestyle": "--"},
    direct_first=True,
)
