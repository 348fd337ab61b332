"""Where photos differ from relit pictures by more than noise: by frequency, and over the camera.

Misfit is the mean squared difference over the variance that noise gives it, as in `misfit`, where
the pictures of some camera pixels are compared to find causes; here all of them are, in bands of
rows.

Index convention: maps are over camera pixels [y, x], or over square cells of a large camera.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from nearfar.arrays import Booleans, Floats, Size, blocks
from nearfar.capture import Capture
from nearfar.errors import InputError
from nearfar.illumination.frequencies import Frequency
from nearfar.photometry.drift_removal import PhotosWithoutDrift
from nearfar.plan import Plan, Sinusoid
from nearfar.progress import Report, ignore_progress
from nearfar.transport.model import Transport
from nearfar.transport.rows import of_pixels
from nearfar.transport.stored import StoredTransport
from nearfar.workflow.diagnosis.misfit import (
    Fits,
    fit_photos,
    is_white_or_black,
    serves,
)
from nearfar.workflow.diagnosis.sample import read_lines
from nearfar.workflow.reconstruction.sources import photos_without_drift

# Values of photos that are compared at once.
VALUES_AT_ONCE = 2**22
# A larger camera is compared in this many lines, spread evenly, of so many values in all.
CAMERA_PIXELS = 2**18
LINES_OF_LARGE_CAMERA = 64
VALUES_OF_LARGE_CAMERA = 2**17

# Frequencies, or a part of the picture, stand out with this many times the misfit of the others.
STANDS_OUT = 2.5
# Less misfit than this is no matter, whatever the others have.
LEAST_MISFIT = 2.0
PARTS_A_SIDE = 3
DOWN, ACROSS = ("top", "", "bottom"), ("left", "", "right")


@dataclass(frozen=True, eq=False)
class MisfitMaps:
    """How badly photos fit, 1 being what noise makes of it.

    Attributes
    ----------
    of_frequencies : dict of Frequency to float
        Mean over the photos of a frequency, white left out.
    of_checks : float or None
        Mean over check photos, which no estimate uses; None without any.
    of_camera : ndarray, shape (y, x)
        Mean over photos without whites, blacks, stripes and Gray code; NaN where all is saturated.
    saturated : ndarray of bool, shape (y, x)
        Where any channel is saturated, or most of a cell.
    cell : int
        Camera pixels along the side of a cell of the map.
    of_held_out : ndarray, shape (y, x), or None
        Over check photos, the root mean square of what relit pictures are off by, noise included,
        as a share of the photos' without black; NaN as `of_camera`. None without check photos.
    """

    of_frequencies: dict[Frequency, float]
    of_checks: float | None
    of_camera: Floats
    saturated: Booleans
    cell: int
    of_held_out: Floats | None = None


def measure_misfit(
    transport: StoredTransport, capture: Capture, progress: Report = ignore_progress
) -> MisfitMaps | None:
    """Compare every photo with the relit picture of its pattern.

    Of a large camera, evenly spaced lines are compared.

    Parameters
    ----------
    transport : StoredTransport
    capture : Capture
        The one that it was reconstructed from.
    progress : callable
        Called with the step and the share of it that is done.

    Returns
    -------
    MisfitMaps or None
        None if the photos do not tell their noise, as those of inverse pairs, if the transport is
        square, or if all is saturated.

    Raises
    ------
    UnreadableFileError
        If the transport or the capture is damaged.
    """
    if transport.provenance["square"]:
        return None
    plan, camera = capture.plan, transport.camera
    if plan.offset != "reference":
        return None
    try:
        photos, part = _compared(transport, capture, progress)
    except InputError:
        # All of the lines are saturated.
        return None
    counted = ~is_white_or_black(plan) & ~serves(plan, "correspondence")
    checks = serves(plan, "check")
    pitch = lines_apart(camera)
    cells = max(1, round(camera.width / pitch)) if pitch > 1 else None
    sums, values = np.zeros(len(plan.patterns)), 0
    lines, marks, held_out = [], [], []
    values_of_row = len(plan.patterns) * transport.channels * photos.camera.width
    for rows in blocks(photos.camera.height, max(1, VALUES_AT_ONCE // values_of_row)):
        fits = fit_photos(photos, part(rows), rows.start)
        share = (fits.photos - fits.relit) ** 2 / fits.variance
        sums += share.sum(axis=(1, 2, 3), dtype=np.float64)
        known = np.asarray(np.isfinite(fits.variance).any(axis=0))
        values += int(known.sum())
        lines.append(_in_cells(share[counted].mean(axis=0), known, cells))
        if checks.any():
            held_out.append(_off_by(fits, known, cells, checks))
        marks.append(_most_in_cells(np.asarray(~known.all(axis=-1)), cells))
        progress("comparing photos", rows.stop / photos.camera.height)
    misfit = sums / max(values, 1)
    return MisfitMaps(
        _of_frequencies(plan, misfit),
        float(misfit[checks].mean()) if checks.any() else None,
        np.concatenate(lines),
        np.concatenate(marks),
        pitch,
        np.concatenate(held_out) if held_out else None,
    )


def lines_apart(camera: Size) -> int:
    """Return how many rows apart the lines of a large camera are; 1 for a camera compared whole."""
    if camera.pixels <= CAMERA_PIXELS:
        return 1
    return max(1, camera.height // LINES_OF_LARGE_CAMERA)


def _compared(
    transport: StoredTransport, capture: Capture, progress: Report
) -> tuple[PhotosWithoutDrift, Callable[[slice], Transport]]:
    """Return the photos that are compared, and what returns the transport at some of their rows.

    Photos of a large camera are single chunks of their file, so that each is read once, and the
    lines that are compared are kept.
    """
    camera = capture.camera
    pitch = lines_apart(camera)
    if pitch == 1:
        photos = photos_without_drift(capture, progress)
        assert isinstance(photos, PhotosWithoutDrift)
        return photos, transport.rows
    # Single lines, one through each row of cells of the map, and no bands as for an estimate, which
    # uses neighbours.
    rows = np.arange(pitch // 2, camera.height, pitch)
    step = max(1, len(rows) * camera.width * capture.channels // VALUES_OF_LARGE_CAMERA)
    columns = np.arange(step // 2, camera.width, step)
    sample = read_lines(
        capture, rows, columns, lambda share: progress("reading photos to compare", share)
    )
    sampled = sample.of_transport(transport)
    every = np.arange(len(columns))
    return sample.without_drift(), lambda band: of_pixels(
        sampled, np.arange(band.start, band.stop), every
    )


def _in_cells(share: Floats, known: Booleans, cells: int | None) -> Floats:
    """Return the mean over known channels, (y, x), or over so many cells of each line."""
    total, count = share.sum(axis=-1), known.sum(axis=-1)
    if cells is not None:
        total, count = (
            np.stack([part.sum(axis=1) for part in np.array_split(values, cells, axis=1)], axis=1)
            for values in (total, count)
        )
    return np.asarray(np.where(count > 0, total / np.maximum(count, 1), np.nan))


def _off_by(fits: Fits, known: Booleans, cells: int | None, checks: Booleans) -> Floats:
    """Return how far relit pictures are off, as a share of the photos' light, over some photos."""
    off, light = (
        _in_cells(
            np.where(known, (fits.photos[checks] - other) ** 2, 0.0).sum(axis=0), known, cells
        )
        for other in (fits.relit[checks], fits.black)
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.sqrt(off / light)
    return np.where(np.isfinite(share), share, np.nan)


def _most_in_cells(marks: Booleans, cells: int | None) -> Booleans:
    """Return marks, (y, x), or whether more than half of each cell of a line is marked."""
    if cells is None:
        return marks
    parts = np.array_split(marks, cells, axis=1)
    return np.stack([part.mean(axis=1) > 1 / 2 for part in parts], axis=1)


def _of_frequencies(plan: Plan, misfit: Floats) -> dict[Frequency, float]:
    found: dict[Frequency, list[float]] = {}
    is_reference = is_white_or_black(plan)
    for number, pattern in enumerate(plan.patterns):
        if isinstance(pattern, Sinusoid) and not is_reference[number]:
            found.setdefault(pattern.frequency, []).append(float(misfit[number]))
    return {frequency: float(np.mean(values)) for frequency, values in found.items()}


def describe_worst(misfit: MisfitMaps) -> str:
    """Return which photos and which part of the picture fit worst; empty if none stands out."""
    found = [text for text in (_worst_frequencies(misfit), _worst_part(misfit)) if text]
    return f"photos fit worst {' and '.join(found)}" if found else ""


def _worst_frequencies(misfit: MisfitMaps) -> str:
    """Name the coarse, the middle or the fine third of the frequencies."""
    ordered = sorted(
        (float(np.hypot(float(frequency.fy), float(frequency.fx))), value)
        for frequency, value in misfit.of_frequencies.items()
    )
    number = len(ordered)
    if number < 6:
        return ""
    thirds = [ordered[i * number // 3 : (i + 1) * number // 3] for i in range(3)]
    # A single photo that does not fit is no matter of the model.
    medians = [float(np.median([value for _, value in third])) for third in thirds]
    worst = _outstanding(medians)
    if worst is None:
        return ""
    (first, _), *_, (last, _) = thirds[worst]
    return (
        f"at frequencies of {first:.2g} to {last:.2g} cycles per projector pixel "
        f"({_written(medians[worst])})"
    )


def _worst_part(misfit: MisfitMaps) -> str:
    """Name a ninth of the picture."""
    values = np.where(misfit.saturated, np.nan, misfit.of_camera)
    means, names = [], []
    for down, rows in zip(DOWN, np.array_split(values, PARTS_A_SIDE, axis=0), strict=True):
        for across, part in zip(ACROSS, np.array_split(rows, PARTS_A_SIDE, axis=1), strict=True):
            finite = part[np.isfinite(part)]
            means.append(float(finite.mean()) if finite.size else 0.0)
            names.append(" ".join(word for word in (down, across) if word) or "middle")
    worst = _outstanding(means)
    if worst is None:
        return ""
    return f"at the {names[worst]} of the picture ({_written(means[worst])})"


def _written(misfit: float) -> str:
    return f"misfit {misfit:.2g}, where noise alone makes 1"


def _outstanding(misfits: Sequence[float]) -> int | None:
    """Return the place of a misfit that is much larger than the next one."""
    *_, next_worst, worst = np.argsort(misfits)
    limit = max(LEAST_MISFIT, STANDS_OUT * misfits[next_worst])
    return int(worst) if misfits[worst] > limit else None
