"""Brute force, by `nearfar.baselines.brute_force`, with black photographed many times."""

from nearfar.arrays import Size
from nearfar.baselines.brute_force import BruteForce
from nearfar.workflow.rivals.reference import reference_rival

# One photo of black for this many projector pixels.
PIXELS_PER_BLACK = 16


def _with_many_blacks(projector: Size) -> BruteForce:
    # Black's error is in every entry: under white it would weigh P times as much as one photo's.
    return BruteForce(projector, blacks=max(1, projector.pixels // PIXELS_PER_BLACK))


BRUTE_FORCE = reference_rival(
    _with_many_blacks,
    title="brute force",
    line={"color": "#8a6fb0", "marker": "v", "linestyle": ":"},
)
