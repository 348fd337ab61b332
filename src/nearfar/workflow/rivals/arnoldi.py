"""Optical Arnoldi, by `nearfar.baselines.arnoldi`: of T, and of T less its direct light."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from nearfar.baselines.arnoldi import (
    PHOTOS_OF_DIRECT,
    PHOTOS_PER_LIGHT,
    LowRankTransport,
    arnoldi,
    arnoldi_after_direct,
)
from nearfar.baselines.shooting import Shooting
from nearfar.workflow.rivals.bench import Bench
from nearfar.workflow.rivals.coaxial import why_not_coaxial
from nearfar.workflow.rivals.rival import Attempt, Budget, Rival


def _rival(
    title: str,
    assumes: str,
    line: Mapping[str, Any],
    method: Callable[[Shooting], LowRankTransport],
    photos_before: int,
) -> Rival:
    """Return a rival by a method that takes so many photos before its first light."""

    def attempts(bench: Bench, budget: Budget) -> Iterator[Attempt]:
        lights = (budget.photos - photos_before) // PHOTOS_PER_LIGHT
        lights = min(lights, bench.scene.projector.pixels)
        if lights < 1:
            return
        shooting = bench.shooting(budget, photos_before + PHOTOS_PER_LIGHT * lights)
        found = method(shooting)
        yield Attempt(shooting.taken, found)

    return Rival(
        title=title, assumes=assumes, line=line, attempts=attempts, unsuited=why_not_coaxial
    )


ARNOLDI = _rival(
    "optical Arnoldi",
    "coaxial camera, so that T is square and symmetric; T of low rank",
    {"color": "#b0761f", "marker": "<", "linestyle": "-"},
    arnoldi,
    photos_before=0,
)
ARNOLDI_AFTER_DIRECT = _rival(
    "optical Arnoldi, D first",
    "coaxial camera, so that T is square and symmetric; T of low rank but for its diagonal",
    {"color": "#b0761f", "marker": ">", "linestyle": "--"},
    arnoldi_after_direct,
    photos_before=PHOTOS_OF_DIRECT,
)
