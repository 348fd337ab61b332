"""What a tile is estimated from: measurements and correspondence, of the camera or of a square T.

Where a tile depends on rows beside it, its measurements are taken of both tiles, so a tile depends
on how the rest of the camera is cut in two things only, which are estimated over its own rows: the
noise of inverse pairs, and the usual step of q from one camera pixel to the next (by which
correspondence by phase sees mirrored surfaces).
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
from nearfar.errors import InputError
from nearfar.illumination.frequencies import DC
from nearfar.photometry.drift import find_references
from nearfar.photometry.drift_removal import remove_drift
from nearfar.photometry.measure import measure
from nearfar.photometry.measurements import Measurements, join
from nearfar.photometry.photos import Photos
from nearfar.progress import Report

Worked = TypeVar("Worked")

# Bytes of white and black photos that are read at once.
READ_BYTES = 2**26


class Source(Protocol):
    """What the rows of a transport are estimated from."""

    def read(
        self, rows: slice, known: Correspondence | None
    ) -> tuple[Measurements, Correspondence]:
        """Return the measurements and the correspondence of some rows.

        Parameters
        ----------
        rows : slice
        known : Correspondence, optional
            Of these rows, if it was given and not to be found.
        """
        ...

    def saturated(self, rows: slice) -> Booleans | None:
        """Return which camera pixels are at full scale under white; None without a white photo."""
        ...


@dataclass(frozen=True, eq=False)
class CameraSource:
    """The camera's own pixels.

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
        """Measure some rows, and find their correspondence unless it is known."""
        measurements = replace(measure(self.photos, rows), brightest=self.brightest)
        if known is not None:
            return measurements, known
        with _naming(self.capture):
            return measurements, find_correspondence(self.photos, measurements, rows)

    def saturated(self, rows: slice) -> Booleans | None:
        """Look at the white photo: no pattern is brighter."""
        found = white_and_black(self.capture.plan)
        if found is None:
            return None
        (white,) = self.capture.read([found[0]], rows)
        return np.asarray((white >= 1).any(axis=-1))


@dataclass(frozen=True, eq=False)
class SquareSource:
    """The camera pixels that each projector pixel lights, averaged (section 5.1).

    Attributes
    ----------
    measurements : Measurements
        As of a camera with the projector's size.
    correspondence : Correspondence
        Each projector pixel's own place, NaN where it lights no camera pixel.
    full : ndarray of bool, shape (Py, Px), optional
        Whether one of its camera pixels is at full scale under white.
    """

    measurements: Measurements
    correspondence: Correspondence
    full: Booleans | None

    def read(
        self, rows: slice, known: Correspondence | None
    ) -> tuple[Measurements, Correspondence]:
        """Return some rows of the square T's measurements."""
        width = self.measurements.camera.width
        size = Size(rows.stop - rows.start, width)
        pixels = slice(rows.start * width, rows.stop * width)
        return self.measurements.of_pixels(size, pixels), self.correspondence.of_rows(rows)

    def saturated(self, rows: slice) -> Booleans | None:
        """Return which rows of T a saturated camera pixel went into."""
        return self.full[rows] if self.full is not None else None


def camera_source(capture: Capture, photos: Photos) -> CameraSource:
    """Return what the camera's own pixels are estimated from."""
    return CameraSource(capture, photos, brightest_white(photos))


def square_source(
    capture: Capture,
    photos: Photos,
    known: Correspondence | None,
    rows_at_once: int,
    report: Report,
) -> tuple[SquareSource, Correspondence]:
    """Measure the whole camera, and average the camera pixels that each projector pixel lights.

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
        If there is no correspondence to be had, or no direct light.
    """
    tiles = list(blocks(photos.camera.height, rows_at_once))
    measured = _each(tiles, lambda rows: measure(photos, rows), "measuring", report)
    found = known
    if found is None:
        with _naming(capture):
            found = _found(photos, tiles, measured, report)
    if not found.lit.any():
        raise without_light(capture)
    whole, q = onto_projector(measured, found)
    # The largest of all tiles, as of the whole camera.
    excess = max((part.excess_of_sums for part in measured), key=abs)
    whole = replace(whole, excess_of_sums=excess, brightest=_largest_white(whole))
    seen = camera_source(capture, photos).saturated(slice(0, photos.camera.height))
    confidence, full = quality_on_projector(found, seen, whole.camera)
    return SquareSource(whole, Correspondence(q, confidence), full), found


def _found(
    photos: Photos, tiles: Sequence[slice], measured: Sequence[Measurements], report: Report
) -> Correspondence:
    """Find the correspondence of the whole camera, tile by tile where the method allows it."""
    method = method_of(photos.plan)
    if method.rows_beside:
        return method.find(photos, slice(0, photos.camera.height), lambda: join(measured))
    measured_of = {tile.start: part for tile, part in zip(tiles, measured, strict=True)}
    return joined(
        _each(
            tiles,
            lambda tile: method.find(photos, tile, lambda: measured_of[tile.start]),
            "correspondence",
            report,
        )
    )


def _each(
    tiles: Sequence[slice], work: Callable[[slice], Worked], what: str, report: Report
) -> list[Worked]:
    """Do the work for each tile, and report the share done."""
    done = []
    for tile in tiles:
        done.append(work(tile))
        report(what, tile.stop / tiles[-1].stop)
    return done


def photos_without_drift(photos: Photos, report: Report) -> Photos:
    """Return photos by reference without the drift of lamp and ambient light, others as they are.

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
    """Return the largest white less black of the whole camera; 0 without a white photo."""
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
def _naming(capture: Capture) -> Iterator[None]:
    """Name the capture, and a cure, in what is wrong with its photos for correspondence."""
    try:
        yield
    except InputError as error:
        reason = str(error).rstrip(".")
        raise type(error)(f"{capture.path}: {reason}, or give `correspondence`.") from None


def without_light(capture: Capture) -> InputError:
    """Return the fault of a capture that shows no direct light."""
    return InputError(
        f"{capture.path} shows no direct light at any camera pixel: check that the camera "
        f"sees the projector's light, or give `correspondence`."
    )


def _largest_white(measurements: Measurements) -> float:
    """Return the largest response to white, 0 where it was not measured."""
    if DC not in measurements.basis.frequencies:
        return 0.0
    (place,) = measurements.places([DC])
    return float(np.abs(measurements.responses[..., place]).max(initial=0.0))
