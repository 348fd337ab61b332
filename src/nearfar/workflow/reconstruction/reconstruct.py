"""From a capture to a transport, in memory or in a file; here or on many machines."""

from functools import partial
from pathlib import Path

from nearfar.arrays import AnyPath
from nearfar.capture import Capture
from nearfar.correspondence import Correspondence
from nearfar.devices import Device
from nearfar.progress import Report, ignore_progress
from nearfar.transport.model import Transport
from nearfar.workflow.reconstruction.executors import (
    Executor,
    SerialExecutor,
    ThreadExecutor,
    Work,
    execute,
)
from nearfar.workflow.reconstruction.job import prepare, tiling_of
from nearfar.workflow.reconstruction.options import DEFAULT_MEMORY, ReconstructionOptions
from nearfar.workflow.reconstruction.sinks import MemorySink, identity_of, resumable_file
from nearfar.workflow.reconstruction.sources import without_light
from nearfar.workflow.reconstruction.summary import Summary


def reconstruct(
    capture: Capture,
    correspondence: Correspondence | None = None,
    *,
    method: str = "joint",
    square: bool = False,
    memory: int = DEFAULT_MEMORY,
    device: Device = "cpu",
    half: bool = False,
    progress: Report | None = None,
) -> tuple[Transport, Correspondence]:
    """Reconstruct the transport of a capture in memory.

    Parameters
    ----------
    capture : Capture
    correspondence : Correspondence, optional
        By default it is found in the capture: in its stripes or Gray code, or without them by the
        phase of the transport's own photos.
    method, square, memory, device, half
        As `ReconstructionOptions` describes them.
    progress : callable, optional
        Called with what is being done and the share done, 0 to 1.

    Returns
    -------
    transport : Transport
    correspondence : Correspondence
        As given or found, at the camera's own resolution.

    Raises
    ------
    PlanError
        If the plan's patterns are complex, or the method needs other patterns.
    InputError
        If there is no correspondence to be had, no direct light in the photos, a plan by reference
        has too few whites and blacks, a row of the camera does not fit in the memory, or the
        device is not there.

    Examples
    --------
    >>> transport, correspondence = nearfar.reconstruct(capture)
    >>> (transport @ light).shape
    (8, 8)
    """
    options = ReconstructionOptions(method, square, memory, device, half)
    report, sink = progress or ignore_progress, MemorySink()
    job = prepare(capture, options, correspondence, report)
    work = Work(capture, options, correspondence, job.tiling, lambda _report: job)
    execute(work, executor_of(options), sink, report)
    transport, found = sink.collected()
    return transport, job.correspondence or found


def reconstruct_to_file(
    capture: Capture,
    output: AnyPath,
    correspondence: Correspondence | None = None,
    options: ReconstructionOptions | None = None,
    *,
    scheduler: str | None = None,
    resume: bool = False,
    force: bool = False,
    progress: Report | None = None,
) -> Summary:
    """Reconstruct the transport of a capture into a file, tile by tile of camera rows.

    Until the last tile they lie in a folder of the output's name with ``.unfinished`` behind it.
    Whatever stops the work, kill -9 too, the tiles that were written stay there for `resume`.

    Parameters
    ----------
    capture : Capture
    output : str or Path
        Transport to write.
    correspondence : Correspondence, optional
        As `nearfar.reconstruct` takes it.
    options : ReconstructionOptions, optional
    scheduler : str, optional
        Address of a Dask scheduler, for instance ``tcp://10.0.0.1:8786``, whose workers do the
        work. They read the capture and write the output under the same names as this process;
        the options' memory is that of each worker process. The transport is the same to the bit.
    resume : bool
        Go on with the tiles that are there, of the same capture and options.
    force : bool
        Replace a transport that is there and, without `resume`, what was not finished.
    progress : callable, optional
        Called with what is being done and the share done, 0 to 1.

    Returns
    -------
    Summary
        Of the whole camera.

    Raises
    ------
    PlanError, InputError
        As `nearfar.reconstruct`; if what is there is of another capture or other options.
    MissingPackageError
        If there is a scheduler and Dask is not installed.
    ClusterError
        If there is no such scheduler, it has no workers, these lack nearfar, another version of
        it, memory or the files, or are lost again and again.
    NearfarError
        As `nearfar.files.resumable_output`. What was written is kept, and the message says where.
    KeptInterrupt
        If it was interrupted; likewise.

    Examples
    --------
    >>> options = nearfar.ReconstructionOptions(memory=10**9)
    >>> done = nearfar.reconstruct_to_file(capture, "made.zarr", options=options)
    >>> done.lit, nearfar.load_transport("made.zarr").camera
    (64, Size(height=8, width=8))
    """
    options, report, output = (
        options or ReconstructionOptions(),
        progress or ignore_progress,
        Path(output),
    )
    if correspondence is not None and not correspondence.lit.any():
        raise without_light(capture)
    executor = executor_of(options)
    if scheduler is not None:
        # Dask takes a second to load, and may not be installed.
        from nearfar.workflow.reconstruction.cluster import DaskExecutor

        executor = DaskExecutor(scheduler)
    tiling = tiling_of(capture, options, given=correspondence is not None)
    identity = identity_of(capture, correspondence, options, tiling)
    preparing = partial(prepare, capture, options, correspondence)
    work = Work(capture, options, correspondence, tiling, preparing)
    with resumable_file(output, tiling, identity, resume=resume, force=force) as sink:
        return execute(work, executor, sink, report)


def executor_of(options: ReconstructionOptions) -> Executor:
    """Return what works at the tiles in this process."""
    if options.tiles_at_once == 1:
        return SerialExecutor()
    return ThreadExecutor(options.tiles_at_once)
