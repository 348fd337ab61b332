"""Reconstruction on many machines, by Dask: blocks of camera rows as tasks.

The capture and the transport lie where all workers see them under the same name. Each block is
read, reconstructed and written by one worker, in chunks of its own, so that one that is lost costs
its block and doing it over again writes the same. What comes out is what `reconstruct_in_blocks`
gives with the same memory.
"""

import hashlib
import os
import threading
from collections.abc import Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from nearfar.arrays import AnyPath
from nearfar.capture import Capture, open_capture
from nearfar.correspondence import Correspondence
from nearfar.errors import ClusterError, MissingPackageError
from nearfar.files import check_output, new_output
from nearfar.files.writes import abandon
from nearfar.release import version
from nearfar.transport.store import write_provenance
from nearfar.workflow.blocks import (
    MEMORY,
    Job,
    Progress,
    cut_rows,
    prepare,
    reconstruct_block,
    unheard,
    without_light,
)
from nearfar.workflow.methods import Method
from nearfar.workflow.written import Written, write_block

try:
    from dask import config
    from distributed import Client, Future, KilledWorker, as_completed
except ImportError as error:
    raise MissingPackageError(
        f"a scheduler needs Dask, which is not installed ({error}): install it by "
        f"pip install 'nearfar[dask]'."
    ) from error

# Seconds in which a scheduler responses, and has a worker.
PATIENCE = 10

# One block at a time in a process, however many threads it has: that is what memory is for.
_AT_WORK = threading.Lock()


def reconstruct_on(
    scheduler: str,
    capture: Capture,
    output: AnyPath,
    correspondence: Correspondence | None = None,
    *,
    method: Method = "joint",
    memory: int = MEMORY,
    half: bool = False,
    force: bool = False,
    progress: Progress | None = None,
) -> Written:
    """Reconstruct a capture on the workers of a Dask scheduler.

    Parameters
    ----------
    scheduler : str
        Its address, for instance ``tcp://10.0.0.1:8786``.
    capture : Capture
        Workers read it by its path.
    output : str or Path
        The transport to write, in a folder that workers see under the same name.
    correspondence, method, progress
        As `nearfar.reconstruct` takes them.
    memory : int
        Bytes for each worker process.
    force : bool
        Replace a transport that is there.

    Returns
    -------
    Written
        Of the whole camera.

    Raises
    ------
    MissingPackageError
        If Dask is not installed.
    ClusterError
        If there is no such scheduler, it has no workers, these lack nearfar, another version of
        it, memory or the files, or are lost again and again.
    NearfarError
        As `nearfar.reconstruct` and `nearfar.files.new_output`.

    Examples
    --------
    Here with a worker in this process:

    >>> from distributed import LocalCluster
    >>> options = {"n_workers": 1, "processes": False, "dashboard_address": ":0"}
    >>> with LocalCluster(**options) as cluster:
    ...     done = nearfar.reconstruct_on(cluster.scheduler_address, capture, "made.zarr")
    >>> nearfar.load_transport("made.zarr").camera
    Size(height=8, width=8)
    """
    output, report = Path(output), progress or unheard
    check_output(output, force=force)
    if correspondence is not None and not correspondence.lit.any():
        raise without_light(capture)
    source, given = capture.path.resolve(), correspondence is not None
    cut = cut_rows(capture, method=method, memory=memory, given=given)
    with _connected(scheduler) as client, new_output(output, force=force) as partial:
        partial.mkdir()
        _require_workers(client, scheduler, source, partial, memory)
        job = client.submit(_prepared, source, method, memory, given, half, pure=False)
        tasks = []
        for block in cut.blocks():
            known = cut.known_around(block, correspondence)
            tasks.append(client.submit(_reconstructed, job, block, known, partial, pure=False))
        try:
            done = _gathered(client, tasks, scheduler, report)
        except BaseException:
            # Blocks that are under way end, but write no more; nobody is told without a scheduler.
            with suppress(OSError, CancelledError):
                client.cancel([job, *tasks])
                client.run(abandon, partial, on_error="ignore")
            raise
        if not done.lit:
            raise without_light(capture)
        # What workers that were lost had begun to write.
        for left in partial.glob("*/.*.partial"):
            left.unlink()
        write_provenance(partial, done.provenance)
    return done


def _prepared(source: Path, method: Method, memory: int, given: bool, half: bool) -> Job:
    """On a worker: read what all blocks share."""
    return prepare(open_capture(source), method=method, memory=memory, given=given, half=half)


def _reconstructed(job: Job, block: slice, known: Correspondence | None, partial: Path) -> Written:
    """On a worker: reconstruct a block of rows, and write it."""
    with _AT_WORK:
        part = reconstruct_block(job, block, known)
    if not partial.is_dir():
        raise ClusterError(f"{partial} was given up while this block was worked at.")
    return write_block(partial, job.cut, block, part)


def _gathered(
    client: Client, tasks: list[Future[Written]], scheduler: str, report: Progress
) -> Written:
    """Wait for all blocks, and put what they say together."""
    whole = Written()
    try:
        for count, task in enumerate(as_completed(tasks, loop=client.loop), start=1):
            whole = whole.with_block(task.result())
            report("reconstructing", count / len(tasks))
    except KilledWorker as error:
        raise ClusterError(
            f"a block of rows was lost with its worker again and again, {error.last_worker} last: "
            f"look at the workers' logs, and if memory ran out give less --memory."
        ) from error
    except CancelledError as error:
        raise ClusterError(
            f"the scheduler at {scheduler} was lost in the middle of the work: see that it and its "
            f"workers run, and reconstruct again."
        ) from error
    return whole


@contextmanager
def _connected(scheduler: str) -> Iterator[Client]:
    """Connect to a scheduler that has workers."""
    # Correspondence goes with each block; what is worth a warning is left to --memory.
    with config.set({"distributed.admin.large-graph-warning-threshold": "1TB"}):
        try:
            client = Client(scheduler, timeout=PATIENCE, set_as_default=False)
        except (OSError, ValueError) as error:
            raise ClusterError(
                f"there is no scheduler at {scheduler} ({str(error).splitlines()[0]}): start one "
                f"by dask scheduler, and give its address as it prints it, tcp://HOST:8786."
            ) from error
        with client:
            yield client


class _Sight(NamedTuple):
    """What a worker has before it.

    Attributes
    ----------
    version : str
    capture : str
        Digest of what the capture says of itself, or why it cannot be read.
    output : bool
        Whether the transport can be written.
    """

    version: str
    capture: str
    output: bool


def _look(source: Path, partial: Path) -> _Sight:
    """On a worker, or here: see what is there."""
    try:
        capture = hashlib.sha256((source / "zarr.json").read_bytes()).hexdigest()
    except OSError as error:
        capture = error.strerror or str(error)
    return _Sight(version(), capture, os.access(partial, os.W_OK | os.X_OK))


def _require_workers(
    client: Client, scheduler: str, source: Path, partial: Path, memory: int
) -> None:
    """Refuse workers that cannot do the work, before any is given out."""
    try:
        client.wait_for_workers(1, timeout=PATIENCE)
    except TimeoutError as error:
        raise ClusterError(
            f"the scheduler at {scheduler} has no workers: start some by dask worker {scheduler}."
        ) from error
    for address, worker in client.scheduler_info(n_workers=-1)["workers"].items():
        if 0 < worker["memory_limit"] < memory:
            raise ClusterError(
                f"the worker at {address} has {worker['memory_limit'] / 1e9:.1f} GB: give a "
                f"smaller --memory, or start it with --memory-limit {memory / 1e9:.1f}GB or more."
            )
    # Our own functions travel by name: first see that workers know any.
    for address, fault in client.run(exec, "import nearfar", on_error="return").items():
        if fault is not None:
            raise ClusterError(
                f"the worker at {address} cannot import nearfar ({fault}): install nearfar "
                f"{version()} where the workers run."
            )
    sights: dict[str, _Sight] = client.run(_look, source, partial)
    here = _look(source, partial)
    for address, sight in sights.items():
        if sight.version != here.version:
            raise ClusterError(
                f"the worker at {address} has nearfar {sight.version}, and this is "
                f"{here.version}: install the same everywhere."
            )
        if sight.capture != here.capture:
            raise ClusterError(
                f"the worker at {address} does not see {source} as it is here: put it where all "
                f"workers see it under the same name."
            )
        if not sight.output:
            raise ClusterError(
                f"the worker at {address} cannot write to {partial.parent}: put the transport in "
                f"a folder that all workers see under the same name."
            )
