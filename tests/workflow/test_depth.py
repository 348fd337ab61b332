"""Depth of an exact scene under global light, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

import nearfar
from nearfar.arrays import Size
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes import SCENES
from nearfar.scenes.cache import cached_scene
from nearfar.scenes.optics import pinhole, sub_rays
from nearfar.scenes.rays import hit, surface
from nearfar.scenes.stereo import stereo_of_scene
from nearfar.workflow.depth import scale_of_rig, seen_in_capture
from tests.worlds import model_transport

# Scenes of these sizes are made for other tests, too.
GRID, SIZE = Size(32, 32), Size(64, 64)


@pytest.fixture(scope="module")
def capture(tmp_path_factory):
    """Photos of the Cornell box from aside, with noise."""
    scene = cached_scene("cornell-aside", GRID)
    rig = SimulatedRig(scene, "box", SimulatedProjector(), SimulatedCamera(), 1.0, 0)
    plan, _ = nearfar.choose_plan(GRID, 60)
    return nearfar.acquire(plan, tmp_path_factory.mktemp("box") / "box.zarr", rig)


@pytest.mark.slow
def test_error_bars_hold_under_global_light(capture):
    found = nearfar.depth(capture, stereo_of_scene("cornell-aside", GRID, SIZE))
    scene = SCENES["cornell-aside"].compute.surfaces()
    lens = pinhole(scene.camera_view, GRID)
    where = surface(scene.parts, range(len(scene.parts)))
    hits = hit(where, lens.position, sub_rays(lens, SIZE, 1)[0])
    true = np.linalg.norm(hits.position - lens.position, axis=1).reshape(SIZE)
    error = np.abs(np.linalg.norm(found.points, axis=-1) - true)
    kept = np.isfinite(error)
    assert kept.mean() > 0.9
    # 2.3 to 3.3 m away, by projector pixels of 3 cm.
    assert np.median(error[kept]) < 0.05
    assert 0.6 < np.mean(error[kept] < found.deviation[kept]) < 0.76


@pytest.mark.slow
def test_colours_are_those_of_the_picture_under_white(capture):
    colours = seen_in_capture(capture).colours()
    assert (colours.shape, colours.dtype, colours.max()) == ((*SIZE, 3), np.uint8, 255)
    # The red wall is on the left.
    red, green, _ = colours[24:40, 4].mean(axis=0)
    assert red > 2 * green


def test_a_real_rig_tells_its_blocks():
    stereo = stereo_of_scene("cornell-aside", Size(36, 48), SIZE)
    real = {"kind": "real", "projector": {"size": [36, 48], "scale": 3}}
    assert scale_of_rig(real, stereo) == 3
    assert scale_of_rig({"kind": "simulated"}, stereo) is None
    other = {"kind": "real", "projector": {"size": [72, 96], "scale": 3}}
    with pytest.raises(nearfar.NearfarError, match="projector of 72x96"):
        scale_of_rig(other, stereo)


def test_a_transport_without_direct_light_has_no_depth():
    transport = model_transport(Size(16, 20), Size(8, 9), window=5, far=Size(3, 3))
    free = replace(transport, parts=("free",))
    stereo = stereo_of_scene("cornell-aside", Size(16, 20), Size(8, 9))
    with pytest.raises(nearfar.NearfarError, match="no direct light"):
        nearfar.depth(free, stereo)


def test_only_captures_and_transports_have_depth():
    stereo = stereo_of_scene("cornell-aside", GRID, SIZE)
    with pytest.raises(nearfar.NearfarError, match=r"depth of a list was .* nearfar\.open_capture"):
        nearfar.depth([], stereo)
