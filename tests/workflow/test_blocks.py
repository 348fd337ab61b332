"""Memory that is told before, beside what is taken."""

import pytest

from nearfar.arrays import Size
from nearfar.photometry.drift_removal import remove_drift
from nearfar.plan import choose_plan
from nearfar.workflow.blocks import LIBRARIES, SLACK, rows_at_once
from nearfar.workflow.methods import ESTIMATORS
from tests.worlds import model_transport

PROJECTOR, CAMERA = Size(16, 20), Size(30, 9)


@pytest.fixture
def held(shoot):
    plan, _ = choose_plan(PROJECTOR, 60, window=5)
    return shoot(plan, model_transport(PROJECTOR, CAMERA, window=5, far=Size(3, 3), channels=3))


def test_room_is_left_for_references_of_the_whole_camera(held):
    # A block of rows is worked at beside what is known of every row.
    drift = remove_drift(held).drift
    kept = sum(values.nbytes for values in (drift.black, drift.light, drift.unsaturated))
    shared, pixel = ESTIMATORS["joint"].bytes_of(held.plan, 3)
    row = SLACK * pixel * CAMERA.width
    beside = 2 * (ESTIMATORS["joint"].halo + 1)
    memory = LIBRARIES + shared + kept + row * (3 + beside)
    assert rows_at_once(held, "joint", int(memory) + 1) == 3
    assert rows_at_once(held, "joint", int(memory) - 1) == 2
