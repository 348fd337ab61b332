"""Scenes small enough for tests, and a camera without faults."""

import gc
import os
import shutil
import signal
import tempfile
from collections.abc import Callable, Generator
from functools import partial
from pathlib import Path

import pytest

from nearfar import parallel
from nearfar.arrays import Size
from nearfar.photometry.in_memory import PhotosInMemory
from nearfar.plan import Plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.workflow.acquire import acquire_in_memory
from tests.worlds import model_transport

# A shell that runs the tests in the background has SIGINT ignored, and commands started from here
# would inherit that: interrupts are what some tests are about.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

QUIET = SimulatedCamera(full_well=1e9, read_noise=0.0, bits=16, shot_noise=False)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """In CI a test that is skipped for a missing system part has failed.

    Photos that may not be handed on are no such part.
    """
    report = yield
    others = "no real photos" in str(report.longrepr)
    if os.environ.get("CI") and report.skipped and not hasattr(report, "wasxfail") and not others:
        report.outcome = "failed"
        report.longrepr = f"{item.nodeid} was skipped, which CI does not allow: {report.longrepr}"
    return report


def pytest_configure(config: pytest.Config) -> None:
    """Keep the scenes that tests compute in one place; a thread in each of several processes.

    `tests.test_parallel` runs with several threads.
    """
    if "PYTEST_XDIST_WORKER" in os.environ:
        # More threads than processors mostly wait for one another.
        parallel.MAXIMUM_THREADS = 1
    # Processes that run tests side by side find it set by the one that started them.
    if "NEARFAR_CACHE" not in os.environ:
        cache = tempfile.mkdtemp(prefix="nearfar-cache-")
        os.environ["NEARFAR_CACHE"] = cache
        config.add_cleanup(lambda: shutil.rmtree(cache, ignore_errors=True))
    _wait_for_no_disk(config)


def _wait_for_no_disk(config: pytest.Config) -> None:
    """Let `os.fsync` check its file alone: no test cuts the power, and a capture waits often.

    Commands in processes of their own wait as they do for users.
    """
    config.add_cleanup(partial(setattr, os, "fsync", os.fsync))

    def check_file(file: int) -> None:
        os.fstat(file)

    os.fsync = check_file


def pytest_xdist_auto_num_workers() -> int:
    """Run two processes more than there are processors, as many tests wait for others."""
    return len(os.sched_getaffinity(0)) + 2


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the slowest files: were one the last, the others would wait for it."""
    minutes: dict[Path, float] = {}
    for item in items:
        if slow := item.get_closest_marker("slow"):
            before = minutes.get(item.path, 0.0)
            minutes[item.path] = max(before, slow.kwargs.get("minutes", 0.5))
    items.sort(key=lambda item: -minutes.get(item.path, 0.0))


def pytest_collection_finish() -> None:
    """Look seldom through what stays: the tests alone are 350 000 objects.

    Garbage that is young is still collected as often as ever.
    """
    gc.freeze()
    young, middle, _old = gc.get_threshold()
    gc.set_threshold(young, middle, 100)


@pytest.fixture
def shoot() -> Callable[..., PhotosInMemory]:
    """Photograph a plan on a world in memory."""

    def photograph(
        plan: Plan,
        world: object,
        camera: SimulatedCamera = QUIET,
        projector: SimulatedProjector | None = None,
        seed: int = 0,
    ) -> PhotosInMemory:
        optics = projector or SimulatedProjector()
        rig = SimulatedRig(world, "test", optics, camera, 1.0, seed)
        return acquire_in_memory(plan, rig)

    return photograph


@pytest.fixture
def small_world() -> object:
    """A transport that obeys the model: 16x20 projector, 8x9 camera, 2 channels."""
    return model_transport(Size(16, 20), Size(8, 9), window=5, far=Size(3, 3), channels=2)


@pytest.fixture
def folder_listing(tmp_path: Path) -> Callable[[], list[str]]:
    """List what lies in the test's folder, to see that nothing was left behind."""
    return lambda: sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*"))
