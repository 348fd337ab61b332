"""A rival: one photo for each row of the pattern grid, relit as if light spread along rows."""

import numpy as np

from nearfar.workflow.rivals.rival import Attempt, Rival


class _RowScan:
    """Pictures of lit rows, (Py, Cy, Cx, channels); each stands for every pixel of its row."""

    def __init__(self, rows):
        self._rows = rows

    def __matmul__(self, light):
        return np.tensordot(light.mean(axis=1), self._rows, axes=1)


def _photos(projector):
    return projector.height + 1


def _attempts(bench, budget):
    projector = bench.scene.projector
    photos = _photos(projector)
    if photos > budget.photos:
        return
    patterns = [np.zeros(projector, np.uint8) for _ in range(photos)]
    for row, pattern in enumerate(patterns[1:]):
        pattern[row] = 255
    rig = bench.rig(budget.exposure(photos))
    black, *lit = (photo / rig.full_scale for photo in rig.shoot(iter(patterns)))
    yield Attempt(photos, _RowScan(np.stack(lit) - black))


SCAN = Rival(
    title="row scan",
    line={"color": "#777777", "marker": "x", "linestyle": ":"},
    attempts=_attempts,
    photos=_photos,
)
