"""Single photos of inverse pairs that are spoilt are told by name."""

import numpy as np
import pytest
from benchmarks.spoils import SPOILS, shoot_plan

from nearfar.arrays import Size
from nearfar.capture.writing import write_capture
from nearfar.faults.of_single_photos import ShowsOtherPattern
from nearfar.plan import paper_plan
from nearfar.transport.stored import open_transport
from nearfar.workflow.diagnosis.diagnose import find_what_spoils
from nearfar.workflow.reconstruction.reconstruct import reconstruct_to_file

pytestmark = pytest.mark.slow

PLAN = paper_plan(Size(16, 16), 5, (5, 5), correspondence="phase")


@pytest.fixture(scope="module")
def shot():
    return shoot_plan("cornell", PLAN)


@pytest.fixture(scope="module")
def diagnosed(shot, tmp_path_factory):
    def diagnose(photos):
        folder = tmp_path_factory.mktemp("spoilt")
        capture = write_capture(
            shot.plan, folder / "c.zarr", list(photos), full_scale=shot.full_scale
        )
        reconstruct_to_file(capture, folder / "t.zarr")
        return find_what_spoils(open_transport(folder / "t.zarr"), capture)

    return diagnose


@pytest.mark.parametrize("drift", [0.0, 0.05])
def test_good_pairs_are_not_accused_whatever_the_lamp_does(shot, diagnosed, drift):
    lamp = 1 - drift * np.linspace(0, 1, len(shot.photos))[:, None, None, None]
    assert diagnosed(shot.counts(shot.photos * lamp)) == []


@pytest.mark.parametrize(
    ("name", "strength"),
    [
        ("photos rotated", 1),
        ("photos doubled", 1),
        ("exposure of three photos", 0.2),
    ],
)
def test_photos_are_named(shot, diagnosed, name, strength):
    found, *others = diagnosed(SPOILS[name].apply(shot, strength))
    assert found.cause in SPOILS[name].causes
    assert list(found.photos) == shot.chosen(3 if "three" in name else 1)
    assert others == []


@pytest.mark.parametrize("is_pair", [False, True])
def test_photos_that_are_swapped_explain_each_other(shot, diagnosed, is_pair):
    first, second = shot.chosen(2)
    if is_pair:
        # Both sum to white all the same.
        second = first + (1 if not PLAN.patterns[first].inverse else -1)
        assert PLAN.patterns[second].frequency == PLAN.patterns[first].frequency
    photos = shot.photos.copy()
    photos[[first, second]] = photos[[second, first]]
    (found,) = diagnosed(photos)
    assert isinstance(found, ShowsOtherPattern)
    assert set(found.photos) == {first, second}
