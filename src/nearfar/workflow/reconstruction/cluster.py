"""Reconstruction on many machines, by Dask: tiles of camera rows as tasks.

All workers see the capture and the transport under the same names. One worker reads, reconstructs
and writes a tile, in chunks that belong to this tile alone. If the worker is lost, another one
reconstructs the tile again and writes the same bytes. The transport equals that of one process with
the same memory, to the bit.
"""

import hashlib
import os
import secrets
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from nearfar.capture import open_capture
from nearfar.correspondence import Correspondence
from nearfar.errors import ClusterError, MissingPackageError
from nearfar.files.writes import abandon, admit
from nearfar.parallel import single_threaded_products
from nearfar.progress import Report, ignore_progress
from nearfar.release import version
from nearfar.workflow.reconstruction.executors import TileReport, Work
from nearfar.workflow.reconstruction.job import Job, prepare, reconstruct_tile
from nearfar.workflow.reconstruction.options import ReconstructionOptions
from nearfar.workflow.reconstruction.sinks import Store, TileWriter
from nearfar.workflow.reconstruction.summary import Summary

try:
    from dask import config
    from distributed import Client, KilledWorker, as_completed
    from distributed.comm.core import CommClosedError
except ImportError as error:
    raise MissingPackageError(
        f"a scheduler needs Dask, which is not installed ({error}): install it by "
        f"pip install 'nearfar[dask]'."
    ) from error

# Time in which a scheduler must answer, and then have a worker.
CONNECTION_SECONDS = 10

# File in the output's folder with the token of the run that may write there. It is removed when the
# run ends.
RUN_MARKER = ".run.partial"

# A worker process reconstructs one tile at a time, however many threads it has: the memory of the
# options is for one tile.
_one_tile = threading.Lock()


class DaskExecutor:
    """Reconstructs tiles on the workers of a Dask scheduler, one at a time in each process.

    Parameters
    ----------
    scheduler : str
        Its address, for instance ``tcp://10.0.0.1:8786``.
    """

    def __init__(self, scheduler: str) -> None:
        self._scheduler = scheduler

    def run(
        self,
        work: Work,
        tiles: Sequence[slice],
        store: Store,
        report: Report,
        tile_report: TileReport,
    ) -> Iterator[tuple[slice, Summary]]:
        """Reconstruct and store tiles; yield each with its summary when it is done.

        Raises
        ------
        ClusterError
            If there is no such scheduler, if it has no workers, or if workers have no nearfar,
            another version of it, too little memory or no access to the files, or are lost again
            and again.
        """
        assert isinstance(store, TileWriter), "workers write into a folder that all see"
        source, scheduler = work.capture.path.resolve(), self._scheduler
        store = replace(store, folder=store.folder.resolve())
        with connected(scheduler) as client, _lost_scheduler(scheduler):
            _require_workers(client, scheduler, source, store.folder, work.options.memory)
            run, marker = secrets.token_hex(8), store.folder / RUN_MARKER
            marker.write_text(run)
            job = client.submit(_prepared, source, work.options, work.correspondence, pure=False)
            tasks = {
                client.submit(
                    _reconstructed, job, tile, work.known_of(tile), store, run, pure=False
                ): tile
                for tile in tiles
            }
            try:
                for task in as_completed(list(tasks), loop=client.loop):
                    yield tasks[task], task.result()
            except KilledWorker as error:
                raise ClusterError(
                    f"a tile was lost with its worker again and again, "
                    f"{error.last_worker} last: look at the workers' logs, and if memory ran out "
                    f"give less `memory`."
                ) from error
            finally:
                # Tiles that are being reconstructed run to their end, but write nothing more.
                marker.unlink(missing_ok=True)
                with suppress(OSError, CancelledError):
                    client.cancel([job, *tasks])
                    client.run(abandon, store.folder, on_error="ignore")


def _prepared(
    source: Path, options: ReconstructionOptions, correspondence: Correspondence | None
) -> Job:
    """On a worker: read what all tiles share."""
    return prepare(open_capture(source), options, correspondence, ignore_progress)


def _reconstructed(
    job: Job, tile: slice, known: Correspondence | None, store: TileWriter, run: str
) -> Summary:
    """On a worker: reconstruct and write a tile."""
    with _one_tile, single_threaded_products():
        _require_run(store.folder, run)
        part = reconstruct_tile(job, tile, known)
        # In this order, a run that ends meanwhile is either noticed here, or drops the writes.
        admit(store.folder)
        _require_run(store.folder, run)
        return store.put(tile, part)


def _require_run(folder: Path, run: str) -> None:
    """Raise an error if the run has ended, or another run has replaced it."""
    try:
        current = (folder / RUN_MARKER).read_text()
    except FileNotFoundError:
        current = ""
    if current != run:
        raise ClusterError(f"{folder} was given up while one of its tiles was worked at.")


@contextmanager
def connected(scheduler: str) -> Iterator[Client]:
    """Connect to a scheduler."""
    # The correspondence of a tile travels with its task, and may exceed what Dask warns of.
    with config.set({"distributed.admin.large-graph-warning-threshold": "1TB"}):
        try:
            client = Client(scheduler, timeout=CONNECTION_SECONDS, set_as_default=False)
        except (OSError, ValueError) as error:
            raise ClusterError(
                f"there is no scheduler at {scheduler} ({str(error).splitlines()[0]}): start one "
                f"by dask scheduler, and give its address as it prints it, tcp://HOST:8786."
            ) from error
        try:
            yield client
        except BaseException:
            # Of a lost scheduler, Dask may close while its attempt to reconnect expires, which is
            # an error of its own and hides what happened.
            with suppress(RuntimeError):
                client.close()
            raise
        client.close()


@contextmanager
def _lost_scheduler(scheduler: str) -> Iterator[None]:
    """Raise a ClusterError if the scheduler is lost.

    Dask cancels the tasks if it notices first. If a result is asked for first, the connection
    breaks off, which is an OSError and must not be taken for a fault of the disk.
    """
    try:
        yield
    except (CancelledError, CommClosedError) as error:
        raise ClusterError(
            f"the scheduler at {scheduler} was lost in the middle of the work: see that it "
            f"and its workers run, and reconstruct again."
        ) from error


class _Access(NamedTuple):
    """The version of nearfar in a process, and its access to the files of a reconstruction.

    Attributes
    ----------
    version : str
        Of nearfar.
    capture : str
        Digest of the capture's metadata, or why it cannot be read.
    output : bool
        Whether the transport can be written.
    """

    version: str
    capture: str
    output: bool


def _access(source: Path, folder: Path) -> _Access:
    """On a worker, or here: return the access of this process."""
    try:
        capture = hashlib.sha256((source / "zarr.json").read_bytes()).hexdigest()
    except OSError as error:
        capture = error.strerror or str(error)
    return _Access(version(), capture, os.access(folder, os.W_OK | os.X_OK))


def _require_workers(
    client: Client, scheduler: str, source: Path, folder: Path, memory: int
) -> None:
    """Raise an error, before any tile is submitted, if a worker could not reconstruct one."""
    try:
        client.wait_for_workers(1, timeout=CONNECTION_SECONDS)
    except TimeoutError as error:
        raise ClusterError(
            f"the scheduler at {scheduler} has no workers: start some by dask worker {scheduler}."
        ) from error
    for address, worker in client.scheduler_info(n_workers=-1)["workers"].items():
        if 0 < worker["memory_limit"] < memory:
            raise ClusterError(
                f"the worker at {address} has {worker['memory_limit'] / 1e9:.1f} GB: give a "
                f"smaller `memory`, or start it with {memory / 1e9:.1f} GB or more."
            )
    # Dask sends our functions by name, so workers must be able to import nearfar.
    for address, fault in client.run(exec, "import nearfar", on_error="return").items():
        if fault is not None:
            raise ClusterError(
                f"the worker at {address} cannot import nearfar ({fault}): install nearfar "
                f"{version()} where the workers run."
            )
    accesses: dict[str, _Access] = client.run(_access, source, folder)
    here = _access(source, folder)
    for address, access in accesses.items():
        if access.version != here.version:
            raise ClusterError(
                f"the worker at {address} has nearfar {access.version}, and this is "
                f"{here.version}: install the same everywhere."
            )
        if access.capture != here.capture:
            raise ClusterError(
                f"the worker at {address} does not see {source} as it is here: put it where all "
                f"workers see it under the same name."
            )
        if not access.output:
            raise ClusterError(
                f"the worker at {address} cannot write to {folder.parent}: put the transport in "
                f"a folder that all workers see under the same name."
            )
