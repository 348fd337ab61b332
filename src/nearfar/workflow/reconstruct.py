"""From a capture to a transport."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from nearfar.arrays import blocks
from nearfar.capture import Capture
from nearfar.correspondence import (
    Correspondence,
    correspond_by_photos,
    has_correspondence_photos,
    joined,
    onto_projector,
)
from nearfar.devices import Device, require_device
from nearfar.photometry.measure import measure
from nearfar.photometry.measurements import join
from nearfar.photometry.photos import Photos
from nearfar.transport.model import Transport
from nearfar.transport.rows import stacked
from nearfar.workflow.blocks import (
    MEMORY,
    Job,
    Part,
    Progress,
    by_phase,
    of_all,
    prepare,
    provenance_of,
    reconstruct_block,
    rows_at_once,
    unheard,
    without_drift,
    without_light,
)
from nearfar.workflow.methods import ESTIMATORS, Method


def reconstruct(
    capture: Capture,
    correspondence: Correspondence | None = None,
    *,
    method: Method = "joint",
    square: bool = False,
    memory: int = MEMORY,
    device: Device = "cpu",
    progress: Progress | None = None,
) -> tuple[Transport, Correspondence]:
    """Reconstruct the transport of a capture.

    Parameters
    ----------
    capture : Capture
    correspondence : Correspondence, optional
        By default from the capture's stripes or Gray code, or without them by phase.
    method : {"joint", "paper"}
        Estimator.
    square : bool
        The paper's square T: average the camera pixels that one projector pixel lights.
    memory : int
        Bytes to work in, above what is returned. The camera is cut into blocks of rows; a square
        T takes what it needs.
    device : {"cpu", "cuda", "torch"}
        Where the estimate is made: by NumPy, by PyTorch on an accelerator, or by PyTorch on
        the processor.
    progress : callable, optional
        Told what is being done and the share done, 0 to 1.

    Returns
    -------
    transport : Transport
    correspondence : Correspondence
        As given or found, at the camera's own resolution.

    Raises
    ------
    PlanError
        If the plan's patterns are complex, or not the paper's for its method.
    InputError
        If there is no correspondence to be had, no light in the photos, the plan by reference
        has too few whites and blacks, a row of the camera does not fit in the memory, or the
        device is not there.

    Examples
    --------
    >>> transport, correspondence = nearfar.reconstruct(capture)
    >>> (transport @ light).shape
    (8, 8)
    """
    if square:
        return _squarely(capture, correspondence, method, device, progress or unheard)
    parts = list(
        reconstruct_in_blocks(
            capture,
            correspondence,
            method=method,
            memory=memory,
            device=device,
            progress=progress,
        )
    )
    return stacked([part.transport for part in parts]), joined(
        [part.correspondence for part in parts]
    )


def reconstruct_in_blocks(
    capture: Capture,
    correspondence: Correspondence | None = None,
    *,
    method: Method = "joint",
    memory: int = MEMORY,
    device: Device = "cpu",
    half: bool = False,
    progress: Progress | None = None,
) -> Iterator[Part]:
    """Reconstruct block by block of camera rows, each when it is asked for; see `reconstruct`.

    Parameters
    ----------
    half : bool
        Whether n and f are made float16; the provenance's `rounding` tells by how much that
        strays, as a share of their noise.

    Yields
    ------
    Part
        In order. The provenance of the last one is the whole camera's.
    """
    report = progress or unheard
    if correspondence is not None and not correspondence.lit.any():
        raise without_light(capture)
    given = correspondence is not None
    job = prepare(
        capture,
        method=method,
        memory=memory,
        given=given,
        device=device,
        half=half,
        report=report,
    )
    yield from parts_of(job, correspondence, report)


def parts_of(job: Job, correspondence: Correspondence | None, report: Progress) -> Iterator[Part]:
    """Reconstruct the blocks of a job in order; see `reconstruct_in_blocks`."""
    capture = job.capture
    height, lit = capture.camera.height, False
    provenance: Mapping[str, Any] = {}
    for block in job.cut.blocks():
        known = job.cut.known_around(block, correspondence)
        part = reconstruct_block(job, block, known, job.cut.report_of(block, report))
        lit = lit or bool(part.correspondence.lit.any())
        if block.stop == height and not lit:
            raise without_light(capture)
        provenance = of_all(provenance, part.transport.provenance)
        yield part._replace(transport=replace(part.transport, provenance=provenance))
        report("reconstructing", block.stop / height)


def _squarely(
    capture: Capture,
    correspondence: Correspondence | None,
    method: Method,
    device: Device,
    report: Progress,
) -> tuple[Transport, Correspondence]:
    """Reconstruct the paper's square T, all of it at once."""
    require_device(device)
    estimator = ESTIMATORS[method]
    estimator.require(capture.plan)
    photos = without_drift(capture, report)
    rows = rows_at_once(capture, method, MEMORY)
    measured = []
    for block in blocks(photos.camera.height, rows):
        measured.append(measure(photos, block))
        report("measuring", block.stop / photos.camera.height)
    if correspondence is None and has_correspondence_photos(photos.plan):
        correspondence = _by_photos(photos, rows, report)
    elif correspondence is None:
        correspondence = by_phase(join(measured), str(capture.path))
    if not correspondence.lit.any():
        raise without_light(capture)
    whole, q = onto_projector(measured, correspondence)
    transport = estimator.estimate(
        photos.plan, whole, q, lambda share: report("reconstructing", share), device
    )
    provenance = provenance_of(capture, photos, method=method, square=True)
    provenance["excess_of_sums"] = max((part.excess_of_sums for part in measured), key=abs)
    provenance["rounding"] = 0.0
    return replace(transport, provenance=provenance), correspondence


def _by_photos(photos: Photos, rows: int, report: Progress) -> Correspondence:
    found = []
    for block in blocks(photos.camera.height, rows):
        found.append(correspond_by_photos(photos, block))
        report("correspondence", block.stop / photos.camera.height)
    return joined(found)
