"""Plain arrays: .npy, and the arrays of an .npz by name."""

import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.errors import MissingFileError, UnreadableFileError
from nearfar.files.codecs import DAMAGE


def read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Read the array of an .npy, called ``"array"``, or all of an .npz; nothing is unpickled.

    Raises
    ------
    MissingFileError, UnreadableFileError
        If there is no such file, or it is damaged or holds something else.
    """
    try:
        # Opened here: of a damaged archive NumPy forgets to close what it opened itself.
        with path.open("rb") as file:
            loaded = np.load(file, allow_pickle=False)
            if isinstance(loaded, np.ndarray):
                return {"array": loaded}
            with loaded:
                return dict(loaded.items())
    except FileNotFoundError:
        raise MissingFileError(f"{path} is not there: check the name.") from None
    except (OSError, zipfile.BadZipFile, zlib.error, *DAMAGE) as error:
        raise UnreadableFileError(
            f"{path} cannot be read as arrays: save it again with numpy.save or numpy.savez."
        ) from error
