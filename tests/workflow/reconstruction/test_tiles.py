"""Tiles of camera rows: the memory that is counted, beside what is taken."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.estimate.base import ESTIMATORS
from nearfar.photometry.drift_removal import remove_drift
from nearfar.plan import paper_plan
from nearfar.workflow.reconstruction.tiles import memory_of_tile, reference_bytes, tile_rows
from tests.plans import chosen_plan
from tests.worlds import model_transport

PROJECTOR, CAMERA = Size(16, 20), Size(60, 9)


@pytest.fixture
def photos(shoot):
    return shoot(
        chosen_plan(PROJECTOR, 60, window=5),
        model_transport(PROJECTOR, CAMERA, window=5, far=Size(3, 3), channels=3),
    )


def test_references_of_the_whole_camera_are_counted(photos):
    # A tile is worked at beside what is known of every row.
    drift = remove_drift(photos).drift
    kept = sum(values.nbytes for values in (drift.black, drift.light, drift.unsaturated))
    assert reference_bytes(chosen_plan(PROJECTOR, 60, window=5), CAMERA, 3) == kept
    assert reference_bytes(paper_plan(PROJECTOR, 5, Size(3, 3)), CAMERA, 3) == 0


def test_stripes_are_counted_where_they_come_without_pairs():
    # So many frequencies that q needs few rows beside without stripes, too.
    projector, camera, far = Size(270, 480), Size(40, 60), Size(9, 9)
    with_stripes, without = (
        paper_plan(projector, 5, far, offset="reference", correspondence=correspondence)
        for correspondence in ("stripes", "none")
    )
    # q is found in the stripes of one axis after the other, all of a tile's rows at once.
    more = memory_of_tile(with_stripes, camera, 1, ESTIMATORS["joint"], 40)
    more -= memory_of_tile(without, camera, 1, ESTIMATORS["joint"], 40)
    assert more >= 480 * camera.pixels * np.dtype(np.float32).itemsize


@pytest.mark.parametrize("method", ["joint", "paper"])
@pytest.mark.parametrize("rows", [1, 3, 15])
def test_as_many_rows_are_taken_as_fit(method, rows):
    plan = paper_plan(PROJECTOR, 5, Size(3, 3))
    estimator = ESTIMATORS[method]
    memory = int(memory_of_tile(plan, CAMERA, 3, estimator, rows))
    for bytes_more, expected in ((1, rows), (-1, rows - 1)):
        if expected:
            tiling = tile_rows(plan, CAMERA, 3, estimator, 2, memory + bytes_more)
            assert (tiling.rows, tiling.halo, tiling.height) == (expected, 2, 60)
        else:
            with pytest.raises(InputError, match="too little for one row"):
                tile_rows(plan, CAMERA, 3, estimator, 2, memory + bytes_more)


def test_tiles_cover_the_camera_and_their_halo_ends_at_its_border():
    plan, estimator = paper_plan(PROJECTOR, 5, Size(3, 3)), ESTIMATORS["joint"]
    memory = int(memory_of_tile(plan, CAMERA, 3, estimator, 21.5))
    tiling = tile_rows(plan, CAMERA, 3, estimator, 4, memory)
    # Tiles of many rows are of a multiple of 8, so that chunks of a file divide them.
    assert [(tile.start, tile.stop) for tile in tiling.tiles()] == [
        (0, 16), (16, 32), (32, 48), (48, 60)
    ]  # fmt: skip
    around = [tiling.with_halo(tile) for tile in tiling.tiles()]
    assert [(rows.start, rows.stop) for rows in around] == [(0, 20), (12, 36), (28, 52), (44, 60)]
    # Chessboards of tiles are those of the whole camera, so that an odd halo is a row more above.
    odd = tiling._replace(halo=5)
    around = [odd.with_halo(tile) for tile in odd.tiles()]
    assert [(rows.start, rows.stop) for rows in around] == [(0, 21), (10, 37), (26, 53), (42, 60)]
