"""Plain arrays: .npy, and the arrays of an .npz by name."""

import zipfile
import zlib
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from nearfar.errors import UnreadableFileError
from nearfar.files.codecs import DAMAGE
from nearfar.files.output import new_output
from nearfar.files.reading import reading_faults


def write_array(path: Path, array: NDArray[Any], *, force: bool = False) -> None:
    """Write an .npy, whole or not at all.

    Parameters
    ----------
    path : Path
    array : ndarray
        Of numbers.
    force : bool
        Replace a file that is there.

    Raises
    ------
    ExistingOutputError, MissingFileError, StorageError
        As `nearfar.files.new_output`.
    """
    array = np.ascontiguousarray(array)
    with new_output(path, force=force) as partial, partial.open("wb") as file:
        header = np.lib.format.header_data_from_array_1_0(array)
        np.lib.format.write_array_header_1_0(file, header)
        # NumPy's own writing does not tell a full disk from other faults.
        file.write(array.data)


def read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Read the array of an .npy, called ``"array"``, or all of an .npz; nothing is unpickled.

    Raises
    ------
    MissingFileError, UnreadableFileError
        If there is no such file, or it may not be read, is damaged or holds something else.
    """
    # Opened here: of a damaged archive NumPy forgets to close what it opened itself.
    with reading_faults(path), path.open("rb") as file:
        return _arrays_of(file, path)


def _arrays_of(file: BinaryIO, path: Path) -> dict[str, NDArray[Any]]:
    try:
        loaded = np.load(file, allow_pickle=False)
        if isinstance(loaded, np.ndarray):
            return {"array": loaded}
        with loaded:
            return dict(loaded.items())
    # A damaged archive names places outside its file, which the system refuses.
    except (OSError, zipfile.BadZipFile, zlib.error, *DAMAGE) as error:
        raise UnreadableFileError(
            f"{path} cannot be read as arrays: save it again with numpy.save or numpy.savez."
        ) from error


def map_array(path: Path) -> NDArray[Any]:
    """Return the array of an .npy as a memory map, which is read where it is used.

    Raises
    ------
    MissingFileError, UnreadableFileError
        If there is no such file, or it may not be read, is damaged or holds something else.
    """
    try:
        with reading_faults(path):
            return np.asanyarray(np.lib.format.open_memmap(path, mode="r"))
    except DAMAGE as error:
        raise UnreadableFileError(
            f"{path} cannot be read as an array: save it again with numpy.save."
        ) from error
