"""Photos of some of a camera's pixels, in patches that lie the same way when the camera is turned.

Index convention: arrays are (..., n, channels), n sampled camera pixels row by row of the sample.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nearfar.arrays import Floats, Integers, Size
from nearfar.capture import Capture
from nearfar.photometry.drift_removal import PhotosWithoutDrift, remove_drift
from nearfar.photometry.in_memory import PhotosInMemory
from nearfar.plan import Plan
from nearfar.transport.model import Transport
from nearfar.transport.rows import of_pixels, stacked
from nearfar.transport.stored import StoredTransport

# Side of a patch: what estimates and derivatives need around them.
PATCH = 8
# Sampled camera pixels, about.
CAMERA_PIXELS = 1536


@dataclass(frozen=True, eq=False)
class CameraSample:
    """Photos of the camera pixels in some rows and columns.

    Attributes
    ----------
    plan : Plan
    photos : ndarray, shape (photos, rows, columns, channels), float32
        In photo units, as they were taken.
    rows, columns : ndarray of int
        Of the camera.
    camera : Size
        The whole camera's.
    """

    plan: Plan
    photos: Floats
    rows: Integers
    columns: Integers
    camera: Size

    @property
    def size(self) -> Size:
        """Rows and columns of the sample."""
        return Size(len(self.rows), len(self.columns))

    def without_drift(self) -> PhotosWithoutDrift:
        """Return the photos without the drift of lamp and ambient light."""
        return remove_drift(PhotosInMemory(self.plan, self.photos, 1.0))

    def of_transport(self, stored: StoredTransport) -> Transport:
        """Read a transport at the sampled camera pixels."""
        if self.size == self.camera:
            return stored.rows()
        parts = []
        for run in np.split(self.rows, np.flatnonzero(np.diff(self.rows) > 1) + 1):
            part = stored.rows(slice(int(run[0]), int(run[-1]) + 1))
            parts.append(of_pixels(part, np.arange(len(run)), self.columns))
        return stacked(parts)


def sample_camera(capture: Capture, progress: Callable[[float], None]) -> CameraSample:
    """Read the photos of a capture at some camera pixels, in patches.

    Parameters
    ----------
    capture : Capture
    progress : callable
        Called with the share of the photos that have been read.

    Raises
    ------
    UnreadableFileError
        If photos are damaged.
    """
    return read_lines(capture, *sampled_lines(capture.camera), progress)


def read_lines(
    capture: Capture, rows: Integers, columns: Integers, progress: Callable[[float], None]
) -> CameraSample:
    """Read the photos of a capture where some rows and columns of the camera cross.

    Each photo is read once, whole.

    Parameters
    ----------
    capture : Capture
    rows, columns : ndarray of int
    progress : callable
        Called with the share of the photos that have been read.

    Raises
    ------
    UnreadableFileError
        If photos are damaged.
    """
    camera = capture.camera
    numbers = len(capture.plan.patterns)
    photos = np.empty((numbers, len(rows), len(columns), capture.channels), dtype=np.float32)
    for number in range(numbers):
        (photo,) = capture.read([number], slice(0, camera.height))
        photos[number] = photo[np.ix_(rows, columns)]
        progress((number + 1) / numbers)
    return CameraSample(capture.plan, photos, rows, columns, camera)


def sampled_lines(camera: Size) -> tuple[Integers, Integers]:
    """Choose rows and columns of a camera: all of a small one, else runs spread evenly.

    Turned upside down, or mirrored, the same are chosen.
    """
    # To recognise turned photos, these lines must fall on one another when a photo is turned; those
    # of `bands` and `choose_rows` do not.
    if camera.pixels <= 1.5 * CAMERA_PIXELS:
        return np.arange(camera.height), np.arange(camera.width)
    share = np.sqrt(CAMERA_PIXELS / camera.pixels)
    height = min(camera.height, max(PATCH, share * camera.height))
    return _runs(camera.height, height), _runs(camera.width, CAMERA_PIXELS / height)


def _runs(length: int, wanted: float) -> Integers:
    count = max(2, round(wanted / PATCH))
    if count * PATCH >= length:
        return np.arange(length)
    half = np.linspace(0, length - PATCH, count)[: count // 2].astype(np.int64)
    starts = [*half, *([(length - PATCH) // 2] if count % 2 else []), *(length - PATCH - half)]
    lines = np.add.outer(np.array(starts, dtype=np.int64), np.arange(PATCH)).ravel()
    return np.unique(lines)
