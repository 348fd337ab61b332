"""Room for many photos: in memory, or in a temporary file if they are large."""

import math
import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from nearfar.errors import StorageError


def room_for(
    shape: tuple[int, ...], dtype: DTypeLike, memory: int, folder: Path | None = None
) -> NDArray[Any]:
    """Return an array to fill, in memory if it takes at most `memory`, else in a temporary file.

    Parameters
    ----------
    shape : tuple of int
        The first axis runs over photos.
    dtype : numpy dtype
    memory : int
        Bytes.
    folder : Path, optional
        Folder of the temporary file; by default the system's.

    Returns
    -------
    ndarray
        With values that are not defined, in memory; 0 in a file. The file has no name, and goes
        with the array.

    Raises
    ------
    StorageError
        If the folder has no room for the file.
    """
    size = math.prod(shape) * np.dtype(dtype).itemsize
    if size <= memory:
        return np.empty(shape, dtype=dtype)
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            # On a full disk, writing to the map of a sparse file would kill the process.
            os.posix_fallocate(file.fileno(), 0, size)
            return np.asarray(np.memmap(file, dtype=dtype, mode="w+", shape=shape))
    except OSError as error:
        raise StorageError(
            f"{shape[0]} photos of {size} bytes in all cannot be kept in "
            f"{folder or tempfile.gettempdir()} ({error.strerror}): make room or name another "
            f"folder."
        ) from error
