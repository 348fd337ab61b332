"""Rivals that take as many photos as T has columns, or more, and decode them linearly."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from nearfar.arrays import Size
from nearfar.baselines.reference import Acquisition, acquire_reference
from nearfar.workflow.rivals.bench import Bench
from nearfar.workflow.rivals.rival import Attempt, Budget, Rival


def reference_rival(
    acquisition: Callable[[Size], Acquisition], *, title: str, line: Mapping[str, Any]
) -> Rival:
    """Make a rival of a reference acquisition.

    Parameters
    ----------
    acquisition : callable
        From the pattern grid to the acquisition.
    title, line
        As of `Rival`.
    """

    def attempts(bench: Bench, budget: Budget) -> Iterator[Attempt]:
        shot = acquisition(bench.scene.projector)
        found = acquire_reference(shot, bench.rig(budget.exposure(shot.photos)))
        yield Attempt(shot.photos, found)

    return Rival(
        title=title,
        assumes="nothing: as many photos as projector pixels",
        line=line,
        attempts=attempts,
        is_dense=True,
        photos=lambda projector: acquisition(projector).photos,
    )
