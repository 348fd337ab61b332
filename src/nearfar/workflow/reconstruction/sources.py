"""Measurements and correspondence of the rows of a tile, for the camera's T or a square T.

A tile is measured together with its halo. Two quantities are estimated from these rows alone, so
they depend on how the camera is divided into tiles: the noise of inverse pairs, and the usual step
of q from one camera pixel to the next, by which correspondence by phase recognises mirrored
surfaces.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Protocol, TypeVar

import numpy as np

from nearfar.arrays import Booleans, Size, blocks
from nearfar.capture import Capture, white_and_black
from nearfar.correspondence import Correspondence, joined, onto_projector
from nearfar.correspondence.methods import find_correspondence, method_of
from nearfar.correspondence.square import quality_on_projector
from nearfar.errors import InputError, UselessPhotosError
from nearfar.illumination.frequencies import DC
from nearfar.photometry.drift import find_references
from nearfar.photometry.drift_removal import remove_drift
from nearfar.photometry.measure import measure
from nearfar.photometry.measurements import Measurements, join
from nearfar.photometry.photos import Photos
from nearfar.progress import Report

Result = TypeVar("Result")

# Memory of the white and black photos that are read at once.
READ_BYTES = 2**26


class Source(Protocol):
    """Measurements and correspondence from which the rows of a transport are estimated."""

    def read(
        self, rows: slice, known: Correspondence | None
    ) -> tuple[Measurements, Correspondence]:
        """Return the measurements and the correspondence of some rows.

        Parameters
        ----------
        rows : slice
        known : Correspondence, optional
            Of these rows, if it is given and need not be found.
        """
        ...

    def saturated(self, rows: slice) -> Booleans | None:
        """Return which camera pixels are at full scale under white; None without a white photo."""
        ...


@dataclass(frozen=True, eq=False)
class CameraSource:
    """Rows of the camera.

    Attributes
    ----------
    capture : Capture
    photos : Photos
        The capture's, without drift.
    brightest : float
        Largest white less black of the whole camera.
    """

    capture: Capture
    photos: Photos
    brightest: float

    def read(
        self, rows: slice, known: Correspondence | None
    ) -> tuple[Measurements, Correspondence]:
        """Measure some rows, and find their correspondence unless it is given."""
        measurements = replace(measure(self.photos, rows), brightest=self.brightest)
        if known is not None:
            return measurements, known
        with _with_capture_named(self.capture):
            return measurements, find_correspondence(self.photos, measurements, rows)

    def saturated(self, rows: slice) -> Booleans | None:
        """Return which camera pixels are at full scale under white, the brightest pattern."""
        found = white_and_black(self.capture.plan)
        if found is None:
            return None
        (white,) = self.capture.read([found[0]], rows)
        return np.asarray((white >= 1).any(axis=-1))


@dataclass(frozen=True, eq=False)
class SquareSource:
    """Rows of a square T: camera pixels averaged by the projector pixel that lights them.

    Section 5.1 of the paper.

    Attributes
    ----------
    measurements : Measurements
        Averaged, as those of a camera with the projector's size.
    correspondence : Correspondence
        The coordinates of each projector pixel, NaN where it lights no camera pixel.
    any_saturated : ndarray of bool, shape (Py, Px), optional
        Whether any of its camera pixels is at full scale under white.
    """

    measurements: Measurements
    correspondence: Correspondence
    any_saturated: Booleans | None

    def read(
        self, rows: slice, known: Correspondence | None
    ) -> tuple[Measurements, Correspondence]:
        """Return some rows of the square T's measurements."""
        width = self.measurements.camera.width
        size = Size(rows.stop - rows.start, width)
        pixels = slice(rows.start * width, rows.stop * width)
        return self.measurements.of_pixels(size, pixels), self.correspondence.of_rows(rows)

    def saturated(self, rows: slice) -> Booleans | None:
        """Return for each row of T whether any of its camera pixels is saturated."""
        return self.any_saturated[rows] if self.any_saturated is not None else None


def camera_source(capture: Capture, photos: Photos) -> CameraSource:
    """Return the source of the rows of the camera."""
    return CameraSource(capture, photos, brightest_white(photos))


def square_source(
    capture: Capture,
    photos: Photos,
    known: Correspondence | None,
    rows_at_once: int,
    report: Report,
) -> tuple[SquareSource, Correspondence]:
    """Measure the whole camera, and average camera pixels by the projector pixel that lights them.

    Parameters
    ----------
    capture : Capture
    photos : Photos
        The capture's, without drift.
    known : Correspondence, optional
        Of the whole camera, if it was given.
    rows_at_once : int
        Camera rows that are measured at once.
    report : callable

    Returns
    -------
    source : SquareSource
    correspondence : Correspondence
        Of the camera, as given or found.

    Raises
    ------
    InputError
        If no correspondence can be found, or there is no direct light.
    """
    tiles = list(blocks(photos.camera.height, rows_at_once))
    measured = _for_each_tile(tiles, lambda rows: measure(photos, rows), "measuring", report)
    found = known
    if found is None:
        with _with_capture_named(capture):
            found = _find_correspondence(photos, tiles, measured, report)
    if not found.lit.any():
        raise UselessPhotosError(
            f"{capture.path} shows no direct light at any camera pixel, and rows of a square T are "
            f"means over the camera pixels that a projector pixel lights directly: reconstruct "
            f"without `square`."
        )
    whole, q = onto_projector(measured, found)
    excess = max((part.excess_of_sums for part in measured), key=abs)
    whole = replace(whole, excess_of_sums=excess, brightest=_largest_white(whole))
    saturated = camera_source(capture, photos).saturated(slice(0, photos.camera.height))
    confidence, any_saturated = quality_on_projector(found, saturated, whole.camera)
    return SquareSource(whole, Correspondence(q, confidence), any_saturated), found


def _find_correspondence(
    photos: Photos, tiles: Sequence[slice], measured: Sequence[Measurements], report: Report
) -> Correspondence:
    """Find the correspondence of the whole camera, tile by tile where the method allows it."""
    method = method_of(photos.plan)
    if method.rows_needed(photos.plan):
        return method.find(photos, slice(0, photos.camera.height), lambda: join(measured))
    measured_of = {tile.start: part for tile, part in zip(tiles, measured, strict=True)}
    return joined(
        _for_each_tile(
            tiles,
            lambda tile: method.find(photos, tile, lambda: measured_of[tile.start]),
            "correspondence",
            report,
        )
    )


def _for_each_tile(
    tiles: Sequence[slice], work: Callable[[slice], Result], what: str, report: Report
) -> list[Result]:
    """Return the result of the work on each tile, and report the share done."""
    done = []
    for tile in tiles:
        done.append(work(tile))
        report(what, tile.stop / tiles[-1].stop)
    return done


def photos_without_drift(photos: Photos, report: Report) -> Photos:
    """Remove the drift of lamp and ambient light from photos by reference; return others unchanged.

    Raises
    ------
    InputError
        If a plan by reference has too few whites and blacks.
    """
    if photos.plan.offset != "reference":
        return photos
    whites, blacks = find_references(photos.plan)
    total = 2 * (len(whites) + len(blacks))
    return remove_drift(photos, lambda done: report("references", done / total))


def brightest_white(photos: Photos) -> float:
    """Return the largest difference of white and black of the whole camera; 0 without a white."""
    found = white_and_black(photos.plan)
    if found is None:
        return 0.0
    row = 8 * photos.camera.width * photos.channels
    brightest = 0.0
    for rows in blocks(photos.camera.height, READ_BYTES // row):
        white, black = photos.read(list(found), rows)
        brightest = max(brightest, float((white - black).max()))
    return brightest


@contextmanager
def _with_capture_named(capture: Capture) -> Iterator[None]:
    """Add the capture's path and a cure to an error about its photos for correspondence."""
    try:
        yield
    except InputError as error:
        reason = str(error).rstrip(".")
        raise type(error)(
            f"{capture.path}: {reason}, or give `correspondence` to reconstruct."
        ) from None


def _largest_white(measurements: Measurements) -> float:
    """Return the largest response to white, 0 where it was not measured."""
    if DC not in measurements.basis.frequencies:
        return 0.0
    (index,) = measurements.response_indices([DC])
    return float(np.abs(measurements.responses[..., index]).max(initial=0.0))
