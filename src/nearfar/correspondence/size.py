"""Where places are searched for from coarse to fine, and not all of them scored."""

from nearfar.arrays import Size

# Pixels of the largest projector all of whose places are scored.
LARGEST_SCORED = 2**15


def is_coarse_to_fine(projector: Size, pitch: int) -> bool:
    """Return whether places are searched for from coarse to fine; never on a row or a column.

    On projectors with too many places; and at a pitch over 1, where few frequencies are high. What
    direct light explains at these drowns among all responses: by the scores of every place a tenth
    of cornell-aside's lit camera pixels are missed at 128x128 (docs/decisions/0051).
    """
    return (pitch > 1 or projector.pixels > LARGEST_SCORED) and min(projector) > 1
