"""Photos that are taken again: the named ones change, the others do not, and nothing is halfway."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.capture import open_capture
from nearfar.capture.replacing import replace_photos
from nearfar.capture.store import white_and_black
from nearfar.errors import InputError
from nearfar.plan import paper_plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.workflow.acquire import acquire, shoot_again
from tests.cli.conftest import run_nearfar

PLAN = paper_plan(Size(16, 20), 5, Size(3, 3))
COUNT = len(PLAN.patterns)


@pytest.fixture
def rig(small_world):
    return SimulatedRig(small_world, "test", SimulatedProjector(), SimulatedCamera(), 1.0, 0)


@pytest.fixture
def capture(rig, tmp_path):
    return acquire(PLAN, tmp_path / "c.zarr", rig)


def test_named_photos_change_and_no_others(rig, capture):
    before, times = capture.photos[:], capture.times
    again = [3, 7, 8, COUNT - 1]
    spoilt = replace_photos(capture.path, again, [before[0]] * len(again))
    now = spoilt.photos[:]
    same = np.array([np.array_equal(a, b) for a, b in zip(before, now, strict=True)])
    assert set(np.flatnonzero(~same)) == set(again)
    taken = shoot_again(PLAN, capture.path, rig, again)
    # Each with its own number, by which a simulation's noise goes.
    np.testing.assert_array_equal(taken.photos[:], before)
    assert (taken.times[again] > times[again]).all()
    others = np.setdiff1d(np.arange(COUNT), again)
    np.testing.assert_array_equal(taken.times[others], times[others])
    assert [p.name for p in capture.path.parent.iterdir()] == ["c.zarr"]


@pytest.mark.parametrize("bad", ["beyond", "shape", "short", "black"])
def test_what_cannot_be_leaves_the_capture_as_it_was(rig, capture, bad):
    before = capture.photos[:]
    photo = before[3]
    white, _ = white_and_black(PLAN)
    photos = {
        "beyond": ([COUNT], [photo], "has no photo"),
        "shape": ([3], [photo[:-1]], "same camera settings"),
        "short": ([3, 4], [photo], "only 1 photos for the 2"),
        "black": ([white], [np.zeros_like(photo)], "much brighter|much darker"),
    }
    numbers, given, words = photos[bad]
    with pytest.raises(InputError, match=words):
        replace_photos(capture.path, numbers, given)
    np.testing.assert_array_equal(open_capture(capture.path).photos[:], before)
    assert [p.name for p in capture.path.parent.iterdir()] == ["c.zarr"]


def test_another_rig_or_plan_is_refused(rig, capture):
    with pytest.raises(InputError, match=r"another rig \(seed\)"):
        shoot_again(PLAN, capture.path, replace(rig, seed=3), [1])
    other = paper_plan(Size(16, 20), 3, Size(3, 3))
    with pytest.raises(InputError, match="another plan"):
        shoot_again(other, capture.path, rig, [1])


def test_by_the_command_line(tmp_path):
    plan, capture = tmp_path / "p.json", tmp_path / "c.zarr"
    run_nearfar("plan", "--projector", "16x16", "--near", 3, "--far", "3x3", "-o", plan)
    (tmp_path / "rig.toml").write_text('[scene]\nname = "corner"\ncamera = "16x16"\n')
    options = (plan, capture, "--rig", tmp_path / "rig.toml")
    assert run_nearfar("acquire", *options).status == 0
    ran = run_nearfar("acquire", *options, "--reshoot", "4, 7-9")
    assert ran.status == 0, ran.err
    assert "4 photos of" in ran.out
    for wrong in ("x", "4-", "-4", "", "3,,4", "9-4"):
        assert run_nearfar("acquire", *options, "--reshoot", wrong).status == 2, wrong
    for other in (("--resume",), ("--memory", "1GB"), ("--device", "cpu")):
        assert run_nearfar("acquire", *options, "--reshoot", "1", *other).status == 2, other
    another = tmp_path / "another.json"
    run_nearfar("plan", "--projector", "16x16", "--near", 5, "--far", "3x3", "-o", another)
    ran = run_nearfar("acquire", another, *options[1:], "--reshoot", "1")
    assert ran.status == 1
    assert "is of another plan" in ran.err
    ran = run_nearfar("acquire", *options, "--reshoot", "9999")
    assert ran.status == 1
    assert "has no photo 9999" in ran.err
