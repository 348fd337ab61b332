"""Tiles worked at one after another, or side by side; options that cannot be."""

import re
import threading
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import nearfar
from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.plan import choose_plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.transport.rows import FACTORS
from nearfar.workflow.acquire import acquire
from nearfar.workflow.reconstruction import executors
from nearfar.workflow.reconstruction.executors import (
    SerialExecutor,
    ThreadExecutor,
    Work,
    execute,
)
from nearfar.workflow.reconstruction.job import prepare, tiling_of
from nearfar.workflow.reconstruction.options import ReconstructionOptions
from nearfar.workflow.reconstruction.sinks import MemorySink
from tests.workflow.reconstruction.memory import memory_for
from tests.worlds import model_transport

PROJECTOR, CAMERA = Size(16, 20), Size(30, 12)
EXECUTORS = {"serial": SerialExecutor(), "threads": ThreadExecutor(3)}


@pytest.fixture(scope="module")
def capture(tmp_path_factory):
    world = model_transport(PROJECTOR, CAMERA, window=5, far=Size(3, 3), channels=1)
    rig = SimulatedRig(world, "test", SimulatedProjector(), SimulatedCamera(), 0.5, 0)
    path = tmp_path_factory.mktemp("capture") / "c.zarr"
    return acquire(choose_plan(PROJECTOR, 50)[0], path, rig)


@pytest.fixture(scope="module")
def work(capture):
    memory = memory_for(4, capture.plan, CAMERA, "joint", channels=1)
    options = ReconstructionOptions(memory=memory)
    tiling = tiling_of(capture, options, given=False)
    assert len(list(tiling.tiles())) == 8
    return Work(
        capture,
        options,
        None,
        tiling,
        lambda report: prepare(capture, options, None, report),
    )


def _executed(work, executor, report=lambda _what, _share: None):
    sink = MemorySink()
    summary = execute(work, executor, sink, report)
    return *sink.collected(), summary


@pytest.fixture(scope="module")
def executed(work):
    """Return a function that runs the work once with each executor, and records its progress."""

    @cache
    def execute_once(name):
        reports = []
        found = _executed(work, EXECUTORS[name], lambda *report: reports.append(report))
        return *found, reports

    return execute_once


def test_tiles_side_by_side_are_those_one_after_another(executed):
    serial, q, said, _ = executed("serial")
    threaded, found, also_said, _ = executed("threads")
    for name in FACTORS:
        np.testing.assert_array_equal(getattr(threaded, name), getattr(serial, name))
    np.testing.assert_array_equal(found.q, q.q)
    assert threaded.provenance == serial.provenance
    assert also_said == said
    assert said.pixels == CAMERA.pixels


def test_no_more_tiles_are_worked_at_than_asked_for(work, monkeypatch):
    at_work, most, lock = [0], [0], threading.Lock()
    reconstruct_tile = executors.reconstruct_tile

    def counted(*arguments):
        with lock:
            at_work[0] += 1
            most[0] = max(most[0], at_work[0])
        try:
            return reconstruct_tile(*arguments)
        finally:
            with lock:
                at_work[0] -= 1

    monkeypatch.setattr(executors, "reconstruct_tile", counted)
    _executed(work, ThreadExecutor(2))
    assert most == [2]


@pytest.mark.parametrize("name", EXECUTORS)
def test_progress_rises_to_the_whole(executed, name):
    *_, reports = executed(name)
    done = [share for what, share in reports if what == "reconstructing"]
    assert done == sorted(done)
    assert done[-1] == pytest.approx(1.0)


@pytest.mark.parametrize("executor", [SerialExecutor(), ThreadExecutor(2)])
def test_a_fault_of_a_tile_ends_the_job(work, executor, monkeypatch):
    def faulty(_job, tile, *_more):
        raise InputError(f"tile {tile.start} is damaged")

    monkeypatch.setattr(executors, "reconstruct_tile", faulty)
    with pytest.raises(InputError, match="is damaged"):
        _executed(work, executor)


def test_tiles_share_the_memory(capture):
    options = ReconstructionOptions(
        memory=2 * memory_for(4, capture.plan, CAMERA, "joint", channels=1), tiles_at_once=2
    )
    assert tiling_of(capture, options, given=False).rows == 4
    # What is advised for several at once is enough for them.
    with pytest.raises(
        InputError, match=r"in each of 4 tiles at once: give `memory=(\d+)`"
    ) as said:
        tiling_of(capture, replace(options, memory=10**9, tiles_at_once=4), given=False)
    advised = int(re.search(r"`memory=(\d+)`", str(said.value))[1])
    enough = replace(options, memory=advised, tiles_at_once=4)
    assert tiling_of(capture, enough, given=False).rows >= 1
    one, _ = nearfar.reconstruct(capture)
    assert one.camera == CAMERA


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"method": "guess"}, "no method 'guess': choose one of joint, paper"),
        ({"device": "tpu"}, "no device 'tpu'"),
        ({"memory": 0}, "memory is 0"),
        ({"memory": 1.5e9}, "memory is 1500000000.0"),
        ({"memory": True}, "memory is True"),
        ({"memory": "2GB"}, "memory is '2GB'"),
        ({"tiles_at_once": 0}, "tiles_at_once is 0"),
    ],
)
def test_options_that_cannot_be_are_refused(fields, said):
    with pytest.raises(InputError, match=said):
        ReconstructionOptions(**fields)
