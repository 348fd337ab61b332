"""Faults that photos show while they are taken: found where there is one, once, and kept."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.capture import open_capture
from nearfar.errors import KeptInterrupt
from nearfar.plan import paper_plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.workflow.acquire import acquire
from tests.observers import EndsWhere
from tests.plans import chosen_plan
from tests.worlds import model_transport

PAPER = paper_plan(Size(16, 20), 5, Size(3, 3))


def _plan(kind):
    return PAPER if kind == "paper" else chosen_plan(Size(16, 20), 50)


def _rig(world, gamma=1.0, exposure=0.5):
    return SimulatedRig(
        world, "test", SimulatedProjector(gamma=gamma), SimulatedCamera(), exposure, 0
    )


@pytest.mark.parametrize("kind", ["paper", "chosen"])
@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ({}, None),
        ({"gamma": 2.2}, "what white adds, which no linear response does"),
        ({"exposure": 3.0}, "is saturated: expose less"),
    ],
)
def test_a_fault_is_told_once_and_remembered(small_world, tmp_path, kind, fault, words):
    told = []
    acquire(_plan(kind), tmp_path / "c.zarr", _rig(small_world, **fault), on_alarm=told.append)
    assert open_capture(tmp_path / "c.zarr").alarms == tuple(told)
    assert len(told) == (words is not None)
    assert words is None or words in told[0]


@pytest.mark.parametrize("kind", ["paper", "chosen"])
def test_a_capture_that_is_gone_on_with_is_looked_at_too(small_world, tmp_path, kind):
    plan = _plan(kind)

    def stop(number, _photo):
        if number == 6:
            raise KeyboardInterrupt
        return False

    rig, told = _rig(small_world, gamma=2.2), []
    with pytest.raises(KeptInterrupt):
        acquire(plan, tmp_path / "c.zarr", rig, observers=[EndsWhere(stop)])
    acquire(plan, tmp_path / "c.zarr", rig, resume=True, on_alarm=told.append)
    assert any("which no linear response does" in alarm for alarm in told)


def test_the_alarm_of_the_last_photo_before_a_stop_is_stored(small_world, tmp_path):
    whole, path, told = tmp_path / "whole.zarr", tmp_path / "stopped.zarr", []
    rig = _rig(small_world, exposure=3.0)
    acquire(_plan("chosen"), whole, rig, on_alarm=told.append)

    def stop(_number, _photo):
        if told[1:]:
            raise KeyboardInterrupt
        return False

    with pytest.raises(KeptInterrupt):
        acquire(_plan("chosen"), path, rig, on_alarm=told.append, observers=[EndsWhere(stop)])
    acquire(_plan("chosen"), path, rig, resume=True)
    assert open_capture(path).alarms == open_capture(whole).alarms == (told[0],)


def test_light_that_changed_meanwhile_is_told(small_world, tmp_path):
    def stop(number, _photo):
        if number == 25:
            raise KeyboardInterrupt
        return False

    for exposure, warned in ((0.5, 0), (0.45, 1)):
        path = tmp_path / f"{exposure}.zarr"
        with pytest.raises(KeptInterrupt):
            acquire(_plan("chosen"), path, _rig(small_world), observers=[EndsWhere(stop)])
        # A lamp that is darker now, of which the rig knows nothing.
        rig, told = _Darker(_rig(small_world), exposure / 0.5), []
        acquire(_plan("chosen"), path, rig, resume=True, on_alarm=told.append)
        assert len(told) == warned
        assert all("before the capture was stopped" in alarm for alarm in told)


class _Darker:
    def __init__(self, rig, share):
        self._rig, self._share = rig, share

    def __getattr__(self, name):
        return getattr(self._rig, name)

    def shoot(self, patterns, first=0):
        for photo in self._rig.shoot(patterns, first):
            yield (self._share * photo).astype(photo.dtype)


def test_noise_alone_is_no_alarm(tmp_path):
    world = model_transport(Size(16, 20), Size(64, 72), window=5, far=Size(3, 3), channels=1)
    dim = SimulatedCamera(full_well=500.0)
    rig = SimulatedRig(world, "test", SimulatedProjector(), dim, 0.5, 0)
    told = []
    acquire(_plan("chosen"), tmp_path / "c.zarr", rig, on_alarm=told.append)
    assert told == [], np.array(told)
