"""Reconstruction on a Dask cluster of real processes: bit-equal, whatever is lost on the way."""

import os
import signal
import subprocess
import sys
import sysconfig
import threading
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.correspondence import Correspondence, given_correspondence
from nearfar.errors import ClusterError, ExistingOutputError, InputError
from nearfar.plan import choose_plan, paper_plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.transport.store import write_transport
from nearfar.workflow.acquire import acquire
from nearfar.workflow.reconstruct import reconstruct_in_blocks
from tests.absent import said_without
from tests.waiting import LONGEST_WAIT
from tests.workflow.memory import memory_for
from tests.worlds import model_transport

distributed = pytest.importorskip("distributed", reason="Dask is not installed")

from nearfar.workflow.cluster import reconstruct_on  # noqa: E402

PROJECTOR = Size(24, 30)
CAMERA = Size(36, 30)
PLANS = {
    "joint": lambda: choose_plan(PROJECTOR, 60, window=7)[0],
    "paper": lambda: paper_plan(PROJECTOR, 7, Size(3, 3)),
}

pytestmark = pytest.mark.slow


@contextmanager
def _cluster(workers):
    script = Path(__file__).with_name("local_cluster.py")
    command = [sys.executable, str(script), str(workers)]
    # Other threads of BLAS than here, as on other machines.
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "2"}
    with subprocess.Popen(
        command,
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as process:
        yield process.stdout.readline().strip()
        process.stdin.close()
        process.wait(LONGEST_WAIT)


@pytest.fixture(scope="module")
def cluster():
    with _cluster(2) as address:
        yield address


@pytest.fixture
def scheduler():
    """A scheduler without workers."""
    with _cluster(0) as address:
        yield address


@pytest.fixture(scope="module")
def world():
    return model_transport(PROJECTOR, CAMERA, window=7, far=Size(3, 3), channels=3)


def _capture(method, world, folder):
    optics = SimulatedProjector()
    rig = SimulatedRig(world, "test", optics, SimulatedCamera(), 1.0, 0)
    plan = PLANS[method]()
    return acquire(plan, folder / "c.zarr", rig), memory_for(5, plan, CAMERA, method)


def _files(folder):
    return {
        path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()
    }


def _locally(capture, known, method, memory, path, **options):
    parts = list(reconstruct_in_blocks(capture, known, method=method, memory=memory, **options))
    assert len(parts) == 8
    write_transport(path, (part.transport for part in parts), CAMERA.height)


@pytest.mark.parametrize("method", ["joint", "paper"])
@pytest.mark.parametrize("given", [False, True])
def test_the_transport_is_the_local_one_to_the_bit(cluster, world, tmp_path, method, given):
    capture, memory = _capture(method, world, tmp_path)
    known = given_correspondence(world.correspondence, CAMERA, PROJECTOR) if given else None
    _locally(capture, known, method, memory, tmp_path / "local.zarr")
    done = reconstruct_on(
        cluster,
        capture,
        tmp_path / "spread.zarr",
        known,
        method=method,
        memory=memory,
    )
    assert _files(tmp_path / "spread.zarr") == _files(tmp_path / "local.zarr")
    assert done.pixels == CAMERA.pixels


def test_half_precision_is_the_local_one_to_the_bit(cluster, world, tmp_path):
    capture, memory = _capture("joint", world, tmp_path)
    _locally(capture, None, "joint", memory, tmp_path / "local.zarr", half=True)
    done = reconstruct_on(cluster, capture, tmp_path / "spread.zarr", memory=memory, half=True)
    assert _files(tmp_path / "spread.zarr") == _files(tmp_path / "local.zarr")
    assert 0 < done.provenance["rounding"] < 0.5


def test_a_worker_that_is_killed_costs_its_block(cluster, world, tmp_path):
    capture, memory = _capture("joint", world, tmp_path)
    _locally(capture, None, "joint", memory, tmp_path / "local.zarr")
    killed = []
    with distributed.Client(cluster, set_as_default=False) as client:
        pids = client.run(os.getpid)
    assert len(pids) == 2

    def kill():
        while not list(tmp_path.glob(".*partial*/near/c.*")):
            time.sleep(0.01)
        victim = next(iter(pids.values()))
        os.kill(victim, signal.SIGKILL)
        killed.append(victim)

    killer = threading.Thread(target=kill, daemon=True)
    killer.start()
    reconstruct_on(cluster, capture, tmp_path / "spread.zarr", method="joint", memory=memory)
    killer.join(LONGEST_WAIT)
    assert killed
    assert _files(tmp_path / "spread.zarr") == _files(tmp_path / "local.zarr")


def test_a_scheduler_that_is_lost_is_told_and_leaves_nothing(world, tmp_path, monkeypatch):
    monkeypatch.setattr("nearfar.workflow.cluster.PATIENCE", 2)
    capture, memory = _capture("joint", world, tmp_path)
    before = _files(tmp_path)
    with _cluster(2) as address:
        with distributed.Client(address, set_as_default=False) as client:
            host = client.run_on_scheduler(os.getpid)

        def kill():
            while not list(tmp_path.glob(".*partial*/near/c.*")):
                time.sleep(0.01)
            os.kill(host, signal.SIGKILL)

        threading.Thread(target=kill, daemon=True).start()
        with pytest.raises(ClusterError, match="was lost in the middle of the work"):
            reconstruct_on(address, capture, tmp_path / "t.zarr", memory=memory)
    # Workers that go on without a scheduler for a while write nothing more.
    time.sleep(4.0)
    assert _files(tmp_path) == before


def test_a_fault_on_a_worker_is_told_here_and_leaves_nothing(cluster, world, tmp_path):
    capture, memory = _capture("paper", world, tmp_path)
    chunk = tmp_path / "c.zarr" / "photos" / "c.9.0.0.0"
    chunk.write_bytes(chunk.read_bytes()[:-9])
    before = _files(tmp_path)
    with pytest.raises(OSError, match=r"c\.zarr is damaged"):
        reconstruct_on(
            cluster,
            capture,
            tmp_path / "spread.zarr",
            method="paper",
            memory=memory,
        )
    time.sleep(1.0)
    assert _files(tmp_path) == before


def test_an_interrupt_leaves_nothing_behind(cluster, world, tmp_path):
    capture, memory = _capture("joint", world, tmp_path)
    before = _files(tmp_path)

    def interrupt(_what, _share):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        reconstruct_on(
            cluster,
            capture,
            tmp_path / "spread.zarr",
            memory=memory,
            progress=interrupt,
        )
    # Blocks that were under way end in the meantime.
    time.sleep(3.0)
    assert _files(tmp_path) == before


def test_what_cannot_be_is_said_before_any_work(cluster, world, tmp_path, monkeypatch):
    monkeypatch.setattr("nearfar.workflow.cluster.PATIENCE", 2)
    capture, memory = _capture("paper", world, tmp_path)
    before, address = _files(tmp_path), cluster

    def tried(scheduler=address, output="t.zarr", known=None, memory=memory):
        return reconstruct_on(
            scheduler, capture, tmp_path / output, known, method="paper", memory=memory
        )

    with pytest.raises(ClusterError, match=r"no scheduler at tcp://127\.0\.0\.1:9 "):
        tried("tcp://127.0.0.1:9")
    with pytest.raises(ClusterError, match="no scheduler at nonsense://x "):
        tried("nonsense://x")
    with pytest.raises(ClusterError, match=r"has 2\.0 GB: give a smaller --memory"):
        tried(memory=10**10)
    with pytest.raises(InputError, match="too few for one row"):
        tried(memory=10**6)
    with pytest.raises(ExistingOutputError):
        tried(output="c.zarr")
    unlit = np.full((*CAMERA, 2), np.nan, np.float32)
    nothing = Correspondence(unlit, unlit[..., 0])
    with pytest.raises(InputError, match="no direct light"):
        tried(known=nothing)
    assert _files(tmp_path) == before


def test_a_scheduler_without_workers_is_said(scheduler, world, tmp_path, monkeypatch):
    monkeypatch.setattr("nearfar.workflow.cluster.PATIENCE", 1)
    capture, memory = _capture("paper", world, tmp_path)
    with pytest.raises(ClusterError, match="has no workers: start some by dask worker tcp://"):
        reconstruct_on(scheduler, capture, tmp_path / "t.zarr", method="paper", memory=memory)


def _started(client, *command):
    worker = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    client.wait_for_workers(1, timeout=LONGEST_WAIT)
    return worker


@pytest.mark.parametrize("what", ["files", "package"])
def test_workers_that_cannot_do_it_are_named(scheduler, world, tmp_path, what):
    capture, memory = _capture("paper", world, tmp_path)
    before = _files(tmp_path)
    work = [sys.executable, "-m", "distributed.cli.dask_worker", scheduler, "--no-dashboard"]
    if what == "files":
        # A worker that has another folder in the place of ours.
        hidden = ["sh", "-c", f"mount -t tmpfs none {tmp_path} && exec {' '.join(work)}"]
        if subprocess.run(["unshare", "-rm", "true"], check=False, capture_output=True).returncode:
            pytest.skip("unshare, of the Debian package util-linux, may make no namespace here")
        work, said = ["unshare", "-rm", *hidden], "does not see .* as it is here"
    else:
        # Packages by their folder alone: nearfar is there by a .pth file, which is not read.
        site = sysconfig.get_paths()["purelib"]
        program = (
            f"import sys; sys.path.append({site!r}); sys.argv[0] = 'dask-worker'; "
            "from distributed.cli.dask_worker import main; main()"
        )
        work, said = [sys.executable, "-S", "-c", program, *work[3:], "--no-nanny"], "cannot import"
    with distributed.Client(scheduler, set_as_default=False) as client:
        worker = _started(client, *work)
        try:
            with pytest.raises(ClusterError, match=said):
                reconstruct_on(
                    scheduler, capture, tmp_path / "t.zarr", method="paper", memory=memory
                )
        finally:
            worker.terminate()
            worker.wait(LONGEST_WAIT)
    assert _files(tmp_path) == before


def test_without_dask_it_is_said():
    assert "pip install 'nearfar[dask]'" in said_without(
        "distributed", "import nearfar.workflow.cluster"
    )
