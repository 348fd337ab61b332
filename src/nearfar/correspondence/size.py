"""Which projectors are large: too many pixels for every place of them to be scored."""

from nearfar.arrays import Size

# Pixels of the largest projector all of whose places are scored.
LARGEST_SCORED = 2**15


def is_large(projector: Size) -> bool:
    """Return whether places are searched for from coarse to fine; never on a row or a column."""
    return projector.pixels > LARGEST_SCORED and min(projector) > 1
