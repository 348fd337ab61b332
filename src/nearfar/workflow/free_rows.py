"""Reconstruct free rows: lamps without a neighbourhood, or a projector of few pixels.

Index convention: photos are (C, channels, N), patterns (N, P).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, blocks
from nearfar.capture import Capture
from nearfar.correspondence import Correspondence
from nearfar.errors import InputError
from nearfar.estimate.free_rows.design import Design, design_of
from nearfar.estimate.free_rows.estimate import FreeRows, estimate_free_rows, posterior_of
from nearfar.illumination.real_basis import RealBasis, basis_of_every_frequency
from nearfar.photometry.photos import Photos
from nearfar.progress import Report, ignore_progress
from nearfar.release import version
from nearfar.transport import near
from nearfar.transport.model import Transport
from nearfar.transport.quality import Quality
from nearfar.transport.rows import stacked
from nearfar.transport.store_writing import write_transport
from nearfar.workflow.reconstruction.sources import photos_without_drift
from nearfar.workflow.reconstruction.summary import description_of
from nearfar.workflow.verdict.checked import Judged, Reconstructed
from nearfar.workflow.verdict.free_rows import HELD_OUT_PIXELS, judge_free_rows, split_photos

# Lamps whose patterns are taken apart in minutes, and photos of them.
MOST_LAMPS = 4096
MOST_PHOTOS = 8192
# Values in double precision that are held at once, over those of the photos.
COPIES = 6
METHOD = "free rows"


@dataclass(frozen=True, eq=False)
class _Job:
    """What all camera rows are estimated from."""

    capture: Capture
    photos: Photos
    used: NDArray[np.int64]
    design: Design
    basis: RealBasis
    lamps: NDArray[np.int64] | None  # (Cy, Cx)
    judged: Judged
    height: int  # rows of a block


def reconstruct_free_rows(
    capture: Capture,
    correspondence: Correspondence | None = None,
    *,
    memory: int = 2 * 10**9,
    progress: Report = ignore_progress,
) -> Transport:
    """Estimate light from each lamp at each camera pixel, as a number of its own.

    Direct light is that of the lamp that stands out, if one does. Nothing is expected of
    neighbouring lamps, so that patterns should not rely on them either.

    Parameters
    ----------
    capture : Capture
        Of any plan or grey patterns.
    correspondence : Correspondence, optional
        By default the lamp of direct light is found with the rows.
    memory : int
        Bytes to work in.
    progress : callable
        Called with the step and the share of it that is done.

    Returns
    -------
    Transport
        Of the parts "direct" and "free", with a verdict.

    Raises
    ------
    InputError
        If the patterns are too many or in colour, or a row of the camera takes more memory.
    """
    job = _prepare(capture, correspondence, memory, progress)
    return stacked(list(_blocks(job, progress)))


def reconstruct_free_rows_to_file(
    capture: Capture,
    output: Path,
    correspondence: Correspondence | None = None,
    *,
    memory: int = 2 * 10**9,
    force: bool = False,
    progress: Report = ignore_progress,
) -> Reconstructed:
    """Do as `reconstruct_free_rows`, into a file, some rows of the camera at a time.

    Returns
    -------
    Reconstructed

    Raises
    ------
    InputError
        As `reconstruct_free_rows`.
    ExistingOutputError, MissingFileError, StorageError
        As `nearfar.files.new_output`.
    """
    job = _prepare(capture, correspondence, memory, progress)
    write_transport(output, _blocks(job, progress), capture.camera.height, force=force)
    lamps = capture.plan.projector.pixels
    return Reconstructed(
        job.judged,
        f"{capture.camera} camera pixels and {lamps} lamps",
        () if job.design.has_black else (black_taken_as_0(capture),),
    )


def black_taken_as_0(capture: Capture) -> str:
    """Return the warning that no photo tells the black, a sentence."""
    return (
        f"{capture.path} has no photo under black, so that black was taken as 0: what is black in "
        f"the photos stands in T as light."
    )


def _prepare(
    capture: Capture, correspondence: Correspondence | None, memory: int, progress: Report
) -> _Job:
    _require_few(capture)
    patterns = _patterns(capture)
    photos = photos_without_drift(capture, progress)
    used, held_out = split_photos(capture)
    design = design_of(patterns[used])
    values = len(patterns) + 2 * patterns.shape[1]
    needed = COPIES * 8 * capture.camera.width * capture.channels * values
    if needed > memory:
        raise InputError(
            f"{capture.path} needs {needed / 1e9:.2g} GB for a row of {capture.camera.width} "
            f"camera pixels: allow it by `memory`."
        )
    lamps = None
    if correspondence is not None:
        projector = capture.plan.projector
        centres = near.centre(correspondence.q, projector)
        flat = centres[:, 0] * projector.width + centres[:, 1]
        lit = np.isfinite(correspondence.q).all(axis=-1).ravel()
        lamps = np.where(lit, flat, -1).reshape(capture.camera)
    height = min(capture.camera.height, max(1, memory // needed))
    sample = _sample(photos, height)
    chosen = None if lamps is None else lamps.ravel()[sample.pixels]
    judged = judge_free_rows(sample.values, patterns, used, held_out, chosen)
    basis = basis_of_every_frequency(capture.plan.projector)
    return _Job(capture, photos, used, design, basis, lamps, judged, height)


def _require_few(capture: Capture) -> None:
    pixels, photos = capture.plan.projector.pixels, len(capture.plan.patterns)
    if capture.shown is not None and capture.shown.ndim == 4:
        raise InputError(f"{capture.path} has colour patterns: give grey ones.")
    if pixels > MOST_LAMPS or photos > MOST_PHOTOS:
        raise InputError(
            f"{capture.path} has {photos} photos of {pixels} projector pixels, and free rows are "
            f"estimated from up to {MOST_PHOTOS} photos of up to {MOST_LAMPS}: give patterns of a "
            f"coarser grid, or leave a range in the model."
        )


def _patterns(capture: Capture) -> Floats:
    count = len(capture.plan.patterns)
    return np.stack([capture.pattern(number).ravel() for number in range(count)])


@dataclass(frozen=True, eq=False)
class _Sample:
    pixels: NDArray[np.int64]
    values: Floats  # (n, channels, N)


def _sample(photos: Photos, height: int) -> _Sample:
    """Read the photos of some camera pixels, evenly spread."""
    camera = photos.camera
    count = min(HELD_OUT_PIXELS, camera.pixels)
    pixels = np.unique(np.linspace(0, camera.pixels - 1, count).round().astype(np.int64))
    parts = []
    numbers = range(len(photos.plan.patterns))
    for rows in blocks(camera.height, height):
        first, last = rows.start * camera.width, rows.stop * camera.width
        mine = pixels[(pixels >= first) & (pixels < last)] - first
        if len(mine):
            parts.append(_read(photos, numbers, rows)[mine])
    return _Sample(pixels, np.concatenate(parts))


def _read(photos: Photos, numbers: range | NDArray[np.int64], rows: slice) -> Floats:
    """Read photos of some rows of the camera, (C, channels, N)."""
    read = photos.read([int(number) for number in numbers], rows)
    return np.moveaxis(read.reshape(len(read), -1, read.shape[3]), 0, 2)


def _blocks(job: _Job, progress: Report) -> Iterator[Transport]:
    height = job.capture.camera.height
    numbers = np.arange(len(job.capture.plan.patterns))
    for rows in blocks(height, job.height):
        photos = _read(job.photos, numbers, rows)
        lamps = None if job.lamps is None else job.lamps[rows].ravel()
        found = estimate_free_rows(photos[..., job.used], job.design, lamps)
        saturated = photos.max(axis=(1, 2)) >= 1.0
        yield _as_transport(job, found, saturated)
        progress("estimate", min(rows.stop, height) / height)


def _as_transport(job: _Job, rows: FreeRows, saturated: NDArray[np.bool_]) -> Transport:
    capture, projector = job.capture, job.capture.plan.projector
    camera = (-1, capture.camera.width)
    shape = (*camera, capture.channels)
    q = np.stack(np.divmod(rows.lamp, projector.width), axis=1).astype(np.float32)
    q[rows.lamp < 0] = np.nan
    direct = rows.direct.reshape(shape)
    return Transport(
        projector=projector,
        correspondence=q.reshape(*camera, 2),
        direct=direct,
        near=np.zeros((*direct.shape, 0, 0), np.float32),
        far=(rows.free @ job.basis.patterns.T).reshape(*shape, projector.pixels),
        far_basis=job.basis,
        black=rows.black.reshape(shape),
        noise=rows.noise.reshape(shape),
        parts=("direct", "free"),
        posterior=posterior_of(job.design, rows.ratio.reshape(camera)),
        provenance={
            "nearfar": version(),
            "method": METHOD,
            "square": False,
            **description_of(capture),
            "drift": None,
            "excess_of_sums": 0.0,
            "rounding": 0.0,
        },
        quality=Quality(
            np.isfinite(q[:, 0]).astype(np.float32).reshape(camera), saturated.reshape(camera)
        ),
        verdict=job.judged.verdict,
    )
