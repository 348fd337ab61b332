"""Which projectors are large: their footprints may be of many pixels, or their places too many."""

from nearfar.arrays import Size
from nearfar.plan.window import pitch_of

# Pixels of the largest projector all of whose places are scored.
LARGEST_SCORED = 2**15


def is_large(projector: Size) -> bool:
    """Return whether places are searched for from coarse to fine; never on a row or a column.

    So they are where windows are of functions of several projector pixels: direct light is then
    that of any number of pixels, not of the few about a place that are scored one by one.
    """
    many = projector.pixels > LARGEST_SCORED or pitch_of(projector) > 1
    return many and min(projector) > 1
