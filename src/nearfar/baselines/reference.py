"""Reference acquisitions: as many photos as T has columns, or more, and a linear decoder.

They assume nothing about the scene, so they give the truth that other methods are compared with, at
the price of many photos. Photos are kept as they come, in a file where they are many, and decoded
for a few camera pixels at a time.

Index convention: m runs over photos in the order they are shot, i over rows, that is over camera
pixels and channels, p over projector pixels.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size, blocks
from nearfar.callbacks import Report
from nearfar.errors import InputError
from nearfar.files.room import room_for
from nearfar.rigs.base import Rig
from nearfar.transport.exact import ExactTransport

# Bytes of photos and of decoded rows in memory at once, the result aside.
DEFAULT_MEMORY_BYTES = 2**29
# Largest memory that a decoder takes for each photo and each column of a row.
BYTES_PER_NUMBER = 64


class Acquisition(Protocol):
    """Patterns to project, and how T follows from their photos."""

    @property
    def name(self) -> str:
        """Name in tables."""
        ...

    @property
    def projector(self) -> Size:
        """Pattern grid."""
        ...

    @property
    def photos(self) -> int:
        """Exposures, those of black and of inverses counted."""
        ...

    def patterns(self) -> Iterator[NDArray[np.uint8]]:
        """Draw the 8-bit patterns (Py, Px) one after the other."""
        ...

    def decode(self, photos: Floats) -> Floats:
        """Return rows of T from their photos.

        Parameters
        ----------
        photos : ndarray, shape (photos, I), float32
            In photo units.

        Returns
        -------
        ndarray, shape (I, P)
            T @ l = photo(l) - photo(black).
        """
        ...


def acquire_reference(
    acquisition: Acquisition,
    rig: Rig,
    *,
    memory: int = DEFAULT_MEMORY_BYTES,
    out: NDArray[np.float32] | None = None,
    folder: Path | None = None,
    progress: Report | None = None,
) -> ExactTransport:
    """Shoot all patterns and decode T in pieces.

    Parameters
    ----------
    acquisition : Acquisition
    rig : Rig
    memory : int
        Bytes of photos and of decoded rows that may be in memory at once; the rig's own and
        `out` come on top. One camera pixel is decoded at a time even where it needs more.
    out : ndarray, shape (channels, C, P), float32, optional
        Where T goes, for instance an np.memmap, for a T larger than memory; a new array by
        default. It becomes `far` of the result, which `nearfar.save_exact` can then keep.
    folder : Path, optional
        Folder of a temporary file that holds the photos if they take more than `memory`; by default
        the system's folder for temporary files.
    progress : callable, optional
        Called with what is being done and the share done.

    Returns
    -------
    ExactTransport
        All in `far`, in photo units.

    Raises
    ------
    InputError
        If the rig has another projector or takes too few photos, or `out` does not fit.
    StorageError
        If the photos cannot be kept.
    """
    if rig.projector != acquisition.projector:
        raise InputError(
            f"{acquisition.name} is for a projector of {acquisition.projector}, the rig has "
            f"{rig.projector}: make it for {rig.projector}."
        )
    report = progress or (lambda _what, _share: None)
    photos, camera = _shoot(acquisition, rig, memory, folder, report)
    pixels, channels = camera.pixels, photos.shape[2]
    columns = acquisition.projector.pixels
    shape = (channels, pixels, columns)
    far = np.empty(shape, dtype=np.float32) if out is None else out
    if far.shape != shape or far.dtype != np.float32:
        raise InputError(
            f"the array for T is {far.dtype} of shape {far.shape}: give float32 of shape {shape}."
        )
    row = BYTES_PER_NUMBER * channels * (acquisition.photos + columns)
    for block in blocks(pixels, memory // 2 // row):
        cut = photos[:, block].reshape(acquisition.photos, -1)
        rows = acquisition.decode(cut.astype(np.float32) / np.float32(rig.full_scale))
        far[:, block] = np.moveaxis(rows.reshape(-1, channels, columns), 1, 0)
        report("decoding", block.stop / pixels)
    return ExactTransport(acquisition.projector, camera, (), (), far, acquisition.name)


def _shoot(
    acquisition: Acquisition, rig: Rig, memory: int, folder: Path | None, report: Report
) -> tuple[NDArray[Any], Size]:
    """Return the photos as they came, shape (photos, C, channels), and the camera's size."""
    kept: NDArray[Any] | None = None
    camera = Size(1, 1)
    taken = 0
    for photo in rig.shoot(acquisition.patterns()):
        if kept is None:
            camera = Size(*photo.shape[:2])
            shape = (acquisition.photos, photo.shape[0] * photo.shape[1], photo.shape[2])
            kept = room_for(shape, photo.dtype, memory // 4, folder)
        kept[taken] = photo.reshape(kept.shape[1:])
        taken += 1
        report("shooting", taken / acquisition.photos)
    if kept is None or taken != acquisition.photos:
        raise InputError(
            f"the rig took {taken} photos of the {acquisition.photos} patterns of "
            f"{acquisition.name}: shoot them all."
        )
    return kept, camera
