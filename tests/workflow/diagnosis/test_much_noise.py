"""What noise and the shrinking of estimates leave of photos is not taken for a fault of the rig."""

from functools import cache

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.capture.writing import write_capture
from nearfar.faults.of_light import ExposureChanged
from nearfar.plan import choose_plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.hostile import hostile_transport
from nearfar.transport.stored import open_transport
from nearfar.workflow.diagnosis.diagnose import find_what_spoils
from nearfar.workflow.reconstruction.reconstruct import reconstruct_to_file
from nearfar.workflow.verdict.verdict import judge_reconstruction

PROJECTORS = {"glass": Size(16, 16), "lamps": Size(15, 15), "permuted": Size(16, 16)}
FULL_SCALE = 65535


@pytest.fixture(scope="module")
def photographed(tmp_path_factory):
    """Return the reconstruction and the capture of a hostile transport, some photos changed."""

    @cache
    def make(name, photos, noise=1 / 60, gains=()):
        scene = hostile_transport(name, PROJECTORS[name], Size(20, 20))
        camera = SimulatedCamera(
            full_well=1e6, read_noise=1e6 * noise, bits=16, black_level=0.12, shot_noise=False
        )
        plan, _ = choose_plan(scene.projector, photos)
        rig = SimulatedRig(scene, name, SimulatedProjector(), camera, 0.8, 0)
        taken = np.stack(list(rig.shoot([plan.draw(i) for i in range(len(plan.patterns))])))
        for number, gain in gains:
            taken[number] = np.clip(taken[number] * gain, 0, FULL_SCALE)
        folder = tmp_path_factory.mktemp(name)
        capture = write_capture(plan, folder / "c.zarr", list(taken), full_scale=rig.full_scale)
        reconstruct_to_file(capture, folder / "t.zarr")
        return open_transport(folder / "t.zarr"), capture

    return make


@pytest.mark.parametrize(
    ("name", "photos", "noise"),
    [
        ("glass", 179, 1 / 60),
        ("glass", 307, 1 / 60),
        ("lamps", 158, 1 / 60),
        ("permuted", 179, 1 / 2000),
    ],
)
def test_good_photos_of_what_no_model_describes_are_not_accused(photographed, name, photos, noise):
    verdict = judge_reconstruction(*photographed(name, photos, noise))
    assert set(verdict.causes) <= {"noise"}


def test_photos_of_one_pattern_that_agree_were_under_one_light(photographed):
    # Without the lowest frequencies, lamps relight a quarter too bright under all their photos.
    stored, capture = photographed("lamps", 225)
    assert find_what_spoils(stored, capture, suspected=True) == []


def test_one_of_several_photos_of_a_pattern_is_found_under_other_light(photographed):
    _, capture = photographed("lamps", 225)
    patterns = capture.plan.patterns
    lowest = [number for number, pattern in enumerate(patterns) if pattern == patterns[3]]
    assert len(lowest) > 2
    stored, capture = photographed("lamps", 225, gains=((lowest[1], 0.5),))
    (found,) = find_what_spoils(stored, capture, suspected=True)
    assert isinstance(found, ExposureChanged)
    assert lowest[1] in found.photos
