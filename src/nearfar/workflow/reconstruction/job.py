"""A reconstruction job: what all tiles share, and how one tile is reconstructed."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

from nearfar.capture import Capture
from nearfar.correspondence import Correspondence
from nearfar.correspondence.methods import method_of
from nearfar.devices import require_device
from nearfar.estimate.base import Estimator, model_of
from nearfar.photometry.photos import Photos
from nearfar.progress import Report
from nearfar.transport.half import in_half, rounding_over_noise
from nearfar.transport.model import Transport
from nearfar.transport.quality import Quality
from nearfar.workflow.reconstruction.options import ReconstructionOptions
from nearfar.workflow.reconstruction.sources import (
    Source,
    camera_source,
    photos_without_drift,
    square_source,
)
from nearfar.workflow.reconstruction.summary import provenance_of
from nearfar.workflow.reconstruction.tiles import Tiling, rows_to_measure, tile_rows


class ReconstructedTile(NamedTuple):
    """The transport and the correspondence of a tile."""

    transport: Transport
    correspondence: Correspondence


@dataclass(frozen=True, eq=False)
class Job:
    """The data that all tiles of a reconstruction share.

    Attributes
    ----------
    capture : Capture
    photos : Photos
        The capture's, without drift.
    options : ReconstructionOptions
    estimator : Estimator
    source : Source
        Measurements and correspondence of the rows of a tile.
    tiling : Tiling
    correspondence : Correspondence, optional
        Of the whole camera, for a square T, which needs it before the first tile.
    """

    capture: Capture
    photos: Photos
    options: ReconstructionOptions
    estimator: Estimator
    source: Source
    tiling: Tiling
    correspondence: Correspondence | None = None


def tiling_of(capture: Capture, options: ReconstructionOptions, *, given: bool) -> Tiling:
    """Divide the rows of the transport into tiles that fit in the memory.

    Parameters
    ----------
    capture : Capture
    options : ReconstructionOptions
    given : bool
        Whether the correspondence is given, so that it need not be found.

    Raises
    ------
    PlanError
        If the estimator cannot use the plan's photos.
    InputError
        If a row does not fit in the memory.
    """
    estimator, plan = options.estimator, capture.plan
    estimator.require(plan)
    found_in_tiles = not (given or options.square)
    halo = estimator.rows_beside(plan) + (
        method_of(plan).rows_needed(plan) if found_in_tiles else 0
    )
    rows = plan.projector if options.square else capture.camera
    return tile_rows(
        plan, rows, capture.channels, estimator, halo, options.memory, options.tiles_at_once
    )


def prepare(
    capture: Capture,
    options: ReconstructionOptions,
    correspondence: Correspondence | None,
    report: Report,
    *,
    estimator: Estimator | None = None,
    photos: Photos | None = None,
) -> Job:
    """Read what all tiles share: references, the brightest white, and measurements of a square T.

    Parameters
    ----------
    capture : Capture
    options : ReconstructionOptions
    correspondence : Correspondence, optional
        Of the whole camera, if it is given.
    report : callable
        Called with the step and the share of it that is done.
    estimator : Estimator, optional
        Used instead of the one that the options name.
    photos : Photos, optional
        The capture's, if they are in memory already.

    Raises
    ------
    PlanError, InputError
        As `nearfar.reconstruct`.
    """
    require_device(options.device)
    tiling = tiling_of(capture, options, given=correspondence is not None)
    drift_free = photos_without_drift(photos or capture, report)
    chosen = estimator or options.estimator
    if not options.square:
        source = camera_source(capture, drift_free)
        return Job(capture, drift_free, options, chosen, source, tiling)
    rows_at_once = rows_to_measure(
        capture.plan, capture.camera, capture.channels, chosen, options.memory
    )
    averaged, found = square_source(capture, drift_free, correspondence, rows_at_once, report)
    return Job(capture, drift_free, options, chosen, averaged, tiling, found)


def reconstruct_tile(
    job: Job,
    tile: slice,
    known: Correspondence | None = None,
    progress: Callable[[float], None] | None = None,
) -> ReconstructedTile:
    """Reconstruct the camera pixels of a tile.

    Parameters
    ----------
    job : Job
    tile : slice
        Rows.
    known : Correspondence, optional
        Of the tile and its halo, if it is given.
    progress : callable, optional
        Called with the share done.

    Returns
    -------
    ReconstructedTile
        With ``excess_of_sums`` and ``rounding`` of this tile in its provenance.
    """
    around = job.tiling.with_halo(tile)
    core = slice(tile.start - around.start, tile.stop - around.start)
    measurements, found = job.source.read(around, known)
    transport = job.estimator.estimate_rows(
        measurements,
        found.q,
        model_of(job.capture.plan),
        core,
        device=job.options.device,
        progress=progress,
    )
    correspondence = found.of_rows(core)
    saturated = job.source.saturated(tile)
    provenance = {
        **provenance_of(job.capture, job.photos, job.options),
        "excess_of_sums": measurements.excess_of_sums,
        "rounding": rounding_over_noise(transport) if job.options.half else 0.0,
    }
    transport = replace(
        in_half(transport) if job.options.half else transport,
        provenance=provenance,
        quality=None if saturated is None else Quality(correspondence.confidence, saturated),
    )
    return ReconstructedTile(transport, correspondence)
