"""Reconstruct the transport of a capture, in memory or into a file, here or on many machines."""

from functools import partial
from pathlib import Path

from nearfar.arrays import AnyPath
from nearfar.capture import Capture
from nearfar.checks import require_instance
from nearfar.correspondence import Correspondence
from nearfar.devices import Device
from nearfar.errors import InputError
from nearfar.progress import Report, ignore_progress
from nearfar.transport.model import Transport
from nearfar.workflow.free_rows import reconstruct_free_rows
from nearfar.workflow.from_patterns import reconstruct_from_patterns
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
    no_near: bool = False,
    no_far: bool = False,
    progress: Report | None = None,
) -> tuple[Transport, Correspondence]:
    """Reconstruct the transport of a capture in memory.

    Parameters
    ----------
    capture : Capture
    correspondence : Correspondence, optional
        By default it is found from the capture: from its stripes or Gray code, or without them
        from the phase of the photos of transport; of pictures that are somebody else's, from what
        each projector pixel shows.
    method, square, memory, device, half
        As `ReconstructionOptions` describes them.
    no_near, no_far : bool
        Both leave out near- and far-range light, as of lamps without a neighbourhood: light from
        each is a number of its own, and no other option but `memory` is heeded.
    progress : callable, optional
        Called with the step and the share of it that is done, 0 to 1.

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
        If no correspondence can be found, the photos show no direct light, a plan by reference has
        too few whites and blacks, a row of the camera does not fit in the memory, or the device is
        not there.

    Examples
    --------
    >>> transport, correspondence = nearfar.reconstruct(capture)
    >>> (transport @ light).shape
    (8, 8)
    """
    _require(capture, correspondence)
    options = ReconstructionOptions(method, square, memory, device, half)
    report, sink = progress or ignore_progress, MemorySink()
    if no_near != no_far:
        raise InputError(
            "one range alone cannot be left out: give both `no_near=True` and `no_far=True`, or "
            "neither."
        )
    if no_near:
        found = reconstruct_free_rows(capture, correspondence, memory=memory, progress=report)
        assert found.quality is not None
        return found, Correspondence(found.correspondence, found.quality.confidence)
    if capture.plan.offset == "shown" and options == ReconstructionOptions(memory=memory):
        found = reconstruct_from_patterns(capture, correspondence, memory=memory, progress=report)
        assert found.quality is not None
        return found, Correspondence(found.correspondence, found.quality.confidence)
    job = prepare(capture, options, correspondence, report)
    work = Work(capture, options, correspondence, job.tiling, lambda _report: job)
    execute(work, executor_of(options), sink, report)
    transport, in_tiles = sink.collected()
    return transport, job.correspondence or in_tiles


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

    Until the last tile is written, the tiles lie in a folder with the output's name and
    ``.unfinished`` appended. Whatever stops the work, kill -9 included, the written tiles stay
    there for `resume`. The transport has no verdict until `nearfar.judge_transport` passes one.

    Parameters
    ----------
    capture : Capture
    output : str or Path
        Transport to write.
    correspondence : Correspondence, optional
        As `nearfar.reconstruct` takes it.
    options : ReconstructionOptions, optional
    scheduler : str, optional
        Address of a Dask scheduler, for instance ``tcp://10.0.0.1:8786``, whose workers
        reconstruct the tiles. They read the capture and write the output under the same paths as
        this process. The options' memory is that of each worker process. The transport is the same
        to the bit.
    resume : bool
        Keep the tiles of a stopped job, and reconstruct the others; capture and options must be
        the same.
    force : bool
        Replace a transport that is there and, without `resume`, the tiles of a stopped job.
    progress : callable, optional
        Called with the step and the share of it that is done, 0 to 1.

    Returns
    -------
    Summary
        Of the whole camera.

    Raises
    ------
    PlanError, InputError
        As `nearfar.reconstruct`; if the tiles to resume are of another capture or other options.
    MissingPackageError
        If a scheduler is given and Dask is not installed.
    ClusterError
        If there is no such scheduler, if it has no workers, or if workers have no nearfar, another
        version of it, too little memory or no access to the files, or are lost again and again.
    NearfarError
        As `nearfar.files.resumable_output`. The message says where the written tiles are kept.
    KeptInterrupt
        If it was interrupted; the message says the same.

    Examples
    --------
    >>> options = nearfar.ReconstructionOptions(memory=10**9)
    >>> done = nearfar.reconstruct_to_file(capture, "made.zarr", options=options)
    >>> done.lit, nearfar.load_transport("made.zarr").camera
    (64, Size(height=8, width=8))
    """
    _require(capture, correspondence)
    options, output = options or ReconstructionOptions(), Path(output)
    executor = executor_of(options)
    if scheduler is not None:
        if options.tiles_at_once != 1:
            raise InputError(
                f"{options.tiles_at_once} tiles at once are for this process, and the workers of a "
                f"scheduler take one each: leave out `tiles_at_once`, and start more workers."
            )
        # Dask takes a second to load, and may not be installed.
        from nearfar.workflow.reconstruction.cluster import DaskExecutor

        executor = DaskExecutor(scheduler)
    tiling = tiling_of(capture, options, given=correspondence is not None)
    identity = identity_of(capture, correspondence, options, tiling)
    preparing = partial(prepare, capture, options, correspondence)
    work = Work(capture, options, correspondence, tiling, preparing)
    with resumable_file(output, tiling, identity, resume=resume, force=force) as sink:
        return execute(work, executor, sink, progress or ignore_progress)


def _require(capture: Capture, correspondence: Correspondence | None) -> None:
    require_instance(capture, Capture, "capture", "nearfar.open_capture")
    if correspondence is not None:
        require_instance(correspondence, Correspondence, "correspondence", "nearfar.correspond")


def executor_of(options: ReconstructionOptions) -> Executor:
    """Return the executor that the options ask for in this process."""
    if options.tiles_at_once == 1:
        return SerialExecutor()
    return ThreadExecutor(options.tiles_at_once)
