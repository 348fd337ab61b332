"""Reconstruction on a Dask cluster of real processes: bit-equal, whatever is lost on the way."""

import os
import shutil
import signal
import subprocess
import sys
import sysconfig
import threading
import time
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import pytest

import nearfar
from nearfar.arrays import Size
from nearfar.capture import open_capture
from nearfar.correspondence import given_correspondence
from nearfar.errors import ClusterError, ExistingOutputError, InputError, KeptInterrupt
from nearfar.plan import choose_plan, paper_plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.workflow.acquire import acquire
from nearfar.workflow.reconstruction.job import tiling_of
from nearfar.workflow.reconstruction.options import ReconstructionOptions
from nearfar.workflow.reconstruction.reconstruct import reconstruct_to_file
from nearfar.workflow.reconstruction.sinks import LOG_NAME
from tests.absent import said_without
from tests.waiting import LONGEST_WAIT
from tests.workflow.reconstruction.memory import memory_for
from tests.worlds import model_transport

distributed = pytest.importorskip("distributed", reason="Dask is not installed")

PROJECTOR = Size(24, 30)
CAMERA = Size(36, 30)
PLANS = {
    "joint": lambda: choose_plan(PROJECTOR, 60, window=7)[0],
    "paper": lambda: paper_plan(PROJECTOR, 7, Size(3, 3)),
}

pytestmark = pytest.mark.slow(minutes=3)


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
    return model_transport(PROJECTOR, CAMERA, window=7, far=Size(3, 3), channels=1)


@pytest.fixture(scope="module")
def captured(world, tmp_path_factory):
    """Return where the capture of a method's plan is, which is taken once."""

    @cache
    def take(method):
        rig = SimulatedRig(world, "test", SimulatedProjector(), SimulatedCamera(), 1.0, 0)
        path = tmp_path_factory.mktemp(method) / "c.zarr"
        acquire(PLANS[method](), path, rig)
        return path

    return take


@pytest.fixture
def copied(captured, tmp_path):
    """Copy the capture of a method into the test's folder; return it, and memory for 5 tiles."""

    def copy(method):
        capture = open_capture(shutil.copytree(captured(method), tmp_path / "c.zarr"))
        return capture, memory_for(8, capture.plan, CAMERA, method, channels=1)

    return copy


@pytest.fixture(scope="module")
def local(captured, tmp_path_factory):
    """Return the files of the transport that this process reconstructs in 5 tiles, jointly."""
    capture = open_capture(captured("joint"))
    path = tmp_path_factory.mktemp("local") / "local.zarr"
    _reconstruct(capture, path, memory=memory_for(8, capture.plan, CAMERA, "joint", channels=1))
    return _files(path)


def _files(folder):
    return {
        path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()
    }


def _reconstruct(
    capture, path, known=None, *, resume=False, progress=None, scheduler=None, **options
):
    return reconstruct_to_file(
        capture,
        path,
        known,
        ReconstructionOptions(**options),
        scheduler=scheduler,
        resume=resume,
        progress=progress,
    )


def _tiles(capture, **options):
    return list(tiling_of(capture, ReconstructionOptions(**options), given=False).tiles())


@pytest.mark.parametrize("method", ["joint", "paper"])
@pytest.mark.parametrize("given", [False, True])
def test_the_transport_is_the_local_one_to_the_bit(
    cluster, world, copied, local, tmp_path, method, given
):
    capture, memory = copied(method)
    known = given_correspondence(world.correspondence, CAMERA, PROJECTOR) if given else None
    options = {"method": method, "memory": memory}
    assert len(_tiles(capture, **options)) == 5
    if (method, given) != ("joint", False):
        _reconstruct(capture, tmp_path / "local.zarr", known, **options)
        local = _files(tmp_path / "local.zarr")
    done = _reconstruct(capture, tmp_path / "spread.zarr", known, scheduler=cluster, **options)
    assert _files(tmp_path / "spread.zarr") == local
    assert done.pixels == CAMERA.pixels


def test_half_precision_is_the_local_one_to_the_bit(cluster, copied, tmp_path):
    capture, memory = copied("joint")
    options = {"memory": memory, "half": True}
    _reconstruct(capture, tmp_path / "local.zarr", **options)
    done = _reconstruct(capture, tmp_path / "spread.zarr", scheduler=cluster, **options)
    assert _files(tmp_path / "spread.zarr") == _files(tmp_path / "local.zarr")
    assert 0 < done.provenance["rounding"] < 0.5


@pytest.mark.parametrize("method", ["joint", "paper"])
def test_a_square_transport_is_the_local_one_to_the_bit(cluster, copied, tmp_path, method):
    capture, _ = copied(method)
    # The square has 24 rows, which tiles of 8 rows with those beside them would cover at once.
    memory = memory_for(2, capture.plan, CAMERA, method, channels=1)
    options = {"method": method, "memory": memory, "square": True}
    assert len(_tiles(capture, **options)) > 2
    _reconstruct(capture, tmp_path / "local.zarr", **options)
    done = _reconstruct(capture, tmp_path / "spread.zarr", scheduler=cluster, **options)
    assert _files(tmp_path / "spread.zarr") == _files(tmp_path / "local.zarr")
    assert done.pixels == PROJECTOR.pixels


def test_a_worker_that_is_killed_costs_its_block(cluster, copied, local, tmp_path):
    capture, memory = copied("joint")
    killed = []
    with distributed.Client(cluster, set_as_default=False) as client:
        pids = client.run(os.getpid)
    assert len(pids) == 2

    def kill():
        while not list(tmp_path.glob("*.unfinished/near/c.*")):
            time.sleep(0.01)
        victim = next(iter(pids.values()))
        os.kill(victim, signal.SIGKILL)
        killed.append(victim)

    killer = threading.Thread(target=kill, daemon=True)
    killer.start()
    _reconstruct(capture, tmp_path / "spread.zarr", scheduler=cluster, memory=memory)
    killer.join(LONGEST_WAIT)
    assert killed
    assert _files(tmp_path / "spread.zarr") == local


def test_a_scheduler_that_is_lost_costs_what_was_not_written(
    cluster, copied, local, tmp_path, monkeypatch
):
    monkeypatch.setattr("nearfar.workflow.reconstruction.cluster.CONNECTION_SECONDS", 2)
    capture, memory = copied("joint")
    log = tmp_path / "t.zarr.unfinished" / LOG_NAME
    with _cluster(2) as address:
        with distributed.Client(address, set_as_default=False) as client:
            host = client.run_on_scheduler(os.getpid)

        killed = []

        def kill(_what, _share):
            # What tiles have in common, and one tile.
            if not killed and log.exists() and log.read_bytes().count(b"\n") >= 2:
                os.kill(host, signal.SIGKILL)
                killed.append(host)

        with pytest.raises(ClusterError, match=r"was lost in the middle.* tiles? (is|are) kept"):
            _reconstruct(
                capture, tmp_path / "t.zarr", scheduler=address, memory=memory, progress=kill
            )
    before = _files(tmp_path)
    # Workers that go on without a scheduler for a while write nothing more.
    time.sleep(4.0)
    assert _files(tmp_path) == before
    done = []
    _reconstruct(
        capture,
        tmp_path / "t.zarr",
        scheduler=cluster,
        memory=memory,
        resume=True,
        progress=lambda _what, share: done.append(share),
    )
    # Fewer tiles than there are were left to be done.
    assert len(done) < len(_tiles(capture, memory=memory))
    assert _files(tmp_path / "t.zarr") == local


def test_a_fault_of_closing_does_not_hide_that_a_scheduler_was_lost(cluster, monkeypatch):
    from nearfar.workflow.reconstruction.cluster import connected

    close = distributed.Client.close

    def close_and_fail(client, *arguments, **options):
        close(client, *arguments, **options)
        raise RuntimeError("Cannot change state of expiring Timeout")

    monkeypatch.setattr(distributed.Client, "close", close_and_fail)
    with pytest.raises(ClusterError, match="was lost"), connected(cluster):
        raise ClusterError("the scheduler was lost")


def test_a_scheduler_that_dies_as_a_result_is_asked_for_is_no_fault_of_the_disk(
    copied, tmp_path, monkeypatch
):
    monkeypatch.setattr("nearfar.workflow.reconstruction.cluster.CONNECTION_SECONDS", 2)
    capture, memory = copied("joint")
    with _cluster(2) as address:
        with distributed.Client(address, set_as_default=False) as client:
            host = client.run_on_scheduler(os.getpid)

        def as_completed_and_lost(tasks, **options):
            for task in distributed.as_completed(tasks, **options):
                os.kill(host, signal.SIGKILL)
                yield task

        monkeypatch.setattr(
            "nearfar.workflow.reconstruction.cluster.as_completed", as_completed_and_lost
        )
        with pytest.raises(ClusterError, match="was lost in the middle"):
            _reconstruct(capture, tmp_path / "t.zarr", scheduler=address, memory=memory)


def test_a_fault_on_a_worker_is_told_here_and_leaves_nothing(cluster, copied, tmp_path):
    capture, memory = copied("paper")
    chunk = tmp_path / "c.zarr" / "photos" / "c.9.0.0.0"
    chunk.write_bytes(chunk.read_bytes()[:-9])
    before = _files(tmp_path)
    with pytest.raises(OSError, match=r"c\.zarr is damaged"):
        _reconstruct(capture, tmp_path / "t.zarr", scheduler=cluster, method="paper", memory=memory)
    time.sleep(1.0)
    assert _files(tmp_path) == before


def test_what_was_interrupted_is_gone_on_with_here_or_there(cluster, copied, local, tmp_path):
    capture, memory = copied("joint")

    def interrupt(_what, _share):
        raise KeyboardInterrupt

    for scheduler, resumed_by in ((cluster, None), (None, cluster)):
        path = tmp_path / f"{'cluster' if scheduler else 'local'}-first.zarr"
        with pytest.raises(KeptInterrupt, match=r"^interrupted; \d+ tiles? (is|are) kept"):
            _reconstruct(
                capture,
                path,
                scheduler=scheduler,
                memory=memory,
                progress=interrupt if scheduler else _interrupt_at(0.4),
            )
        before = _files(tmp_path)
        # Tiles that were under way end in the meantime, and are not written.
        time.sleep(3.0 if scheduler else 0.0)
        assert _files(tmp_path) == before
        _reconstruct(capture, path, scheduler=resumed_by, memory=memory, resume=True)
        assert _files(path) == local


def _interrupt_at(least):
    def progress(what, share):
        if what == "reconstructing" and share >= least:
            raise KeyboardInterrupt

    return progress


def test_what_cannot_be_is_said_before_any_work(cluster, copied, tmp_path, monkeypatch):
    monkeypatch.setattr("nearfar.workflow.reconstruction.cluster.CONNECTION_SECONDS", 2)
    capture, memory = copied("paper")
    before, address = _files(tmp_path), cluster

    def tried(scheduler=address, output="t.zarr", known=None, **options):
        options = {"method": "paper", "memory": memory, **options}
        return _reconstruct(capture, tmp_path / output, known, scheduler=scheduler, **options)

    with pytest.raises(ClusterError, match=r"no scheduler at tcp://127\.0\.0\.1:9 "):
        tried("tcp://127.0.0.1:9")
    with pytest.raises(ClusterError, match="no scheduler at nonsense://x "):
        tried("nonsense://x")
    with pytest.raises(ClusterError, match=r"has 2\.0 GB: give a smaller `memory`"):
        tried(memory=10**10)
    with pytest.raises(InputError, match="too little for one row"):
        tried(memory=10**6)
    with pytest.raises(InputError, match="workers of a scheduler take one each"):
        tried(tiles_at_once=2)
    with pytest.raises(ExistingOutputError):
        tried(output="c.zarr")
    assert _files(tmp_path) == before


def test_a_scheduler_without_workers_is_said(scheduler, copied, tmp_path, monkeypatch):
    monkeypatch.setattr("nearfar.workflow.reconstruction.cluster.CONNECTION_SECONDS", 1)
    capture, memory = copied("paper")
    with pytest.raises(ClusterError, match="has no workers: start some by dask worker tcp://"):
        _reconstruct(
            capture, tmp_path / "t.zarr", scheduler=scheduler, method="paper", memory=memory
        )


def _started(client, *command):
    worker = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    client.wait_for_workers(1, timeout=LONGEST_WAIT)
    return worker


@pytest.mark.parametrize("what", ["files", "package"])
def test_workers_that_cannot_do_it_are_named(scheduler, copied, tmp_path, what):
    capture, memory = copied("paper")
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
                _reconstruct(
                    capture, tmp_path / "t.zarr", scheduler=scheduler, method="paper", memory=memory
                )
        finally:
            worker.terminate()
            worker.wait(LONGEST_WAIT)
    assert _files(tmp_path) == before


def test_without_dask_it_is_said():
    assert "pip install 'nearfar[dask]'" in said_without(
        "distributed", "import nearfar.workflow.reconstruction.cluster"
    )


def test_the_old_name_says_what_replaces_it(cluster, copied, tmp_path):
    capture, memory = copied("paper")
    with pytest.warns(DeprecationWarning, match="reconstruct_to_file"):
        done = nearfar.reconstruct_on(
            cluster, capture, tmp_path / "t.zarr", method="paper", memory=memory
        )
    assert done.pixels == CAMERA.pixels
