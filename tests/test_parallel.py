"""Several threads give what one gives, to the bit."""

import threading
from types import SimpleNamespace

import numpy as np
import pytest

from nearfar import parallel
from nearfar.arrays import Size
from nearfar.devices import ACCELERATOR_BATCH
from nearfar.plan import choose_plan, paper_plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes import build
from nearfar.scenes.cache import cached_scene
from nearfar.transport.rows import FACTORS
from nearfar.workflow.acquire import acquire
from nearfar.workflow.reconstruction.reconstruct import reconstruct

SIZE = Size(16, 16)
PLANS = {"joint": lambda: choose_plan(SIZE, 60)[0], "paper": lambda: paper_plan(SIZE, 7, (3, 3))}


@pytest.fixture(params=[1, 2, 5])
def threads(request, monkeypatch):
    monkeypatch.setattr(parallel, "MAXIMUM_THREADS", request.param)
    monkeypatch.setattr(parallel, "processors", lambda: request.param)
    return request.param


@pytest.fixture(scope="module")
def rig():
    scene = cached_scene("cornell", SIZE)
    return SimulatedRig(scene, "cornell", SimulatedProjector(), SimulatedCamera(), 1.0, 0)


@pytest.fixture(scope="module")
def first():
    return {}


@pytest.mark.parametrize("method", PLANS)
def test_a_reconstruction_does_not_depend_on_threads(method, threads, first, rig, tmp_path):
    capture = acquire(PLANS[method](), tmp_path / "c.zarr", rig)
    found, _ = reconstruct(capture, method=method)
    expected = first.setdefault(method, found)
    for name in FACTORS:
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), strict=True)


def test_a_scene_does_not_depend_on_threads(threads, first):
    found = build("cornell", SIZE)
    np.testing.assert_array_equal(found.far, first.setdefault("scene", found).far)


def test_the_error_of_a_thread_is_raised(threads):
    def fail(item):
        if item == 3:
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        parallel.side_by_side(fail, range(6))


def test_every_item_is_worked_at_once(threads):
    done = []
    parallel.side_by_side(done.append, range(100))
    assert sorted(done) == list(range(100))


@pytest.mark.usefixtures("threads")
def test_an_accelerator_gets_larger_batches_from_one_thread():
    def batches_of(values):
        found, workers = [], set()

        def work(batch):
            found.append((batch.start, batch.stop))
            workers.add(threading.get_ident())

        parallel.in_batches(work, 100, 3, values)
        return sorted(found), workers

    on_processor, _ = batches_of(np.zeros(1))
    assert on_processor == [(n, min(n + 3, 100)) for n in range(0, 100, 3)]
    # All that is asked of an array is where it lies.
    on_accelerator, workers = batches_of(SimpleNamespace(device="cuda:0"))
    length = 3 * ACCELERATOR_BATCH
    assert on_accelerator == [(n, min(n + length, 100)) for n in range(0, 100, length)]
    assert workers == {threading.get_ident()}
