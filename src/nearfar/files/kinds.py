"""The kind of data that a Zarr folder holds, from its metadata."""

import json
from pathlib import Path

from nearfar.files.reading import forbidden_folders

# File in which a Zarr folder says what it is.
METADATA = "zarr.json"


def kind_of_store(path: Path) -> str | None:
    """Return the kind that a Zarr names, such as ``"nearfar capture"``; None if it names none.

    Raises
    ------
    UnreadableFileError
        If its metadata may not be read.
    """
    with forbidden_folders(path):
        try:
            metadata = json.loads((path / METADATA).read_bytes())
            return str(metadata["attributes"]["format"])
        except PermissionError:
            raise
        except (OSError, ValueError, RecursionError, KeyError, TypeError):
            return None
