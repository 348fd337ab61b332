"""The kind of data that a Zarr folder holds, from its metadata."""

import json
from pathlib import Path

# File in which a Zarr folder says what it is.
METADATA = "zarr.json"


def kind_of_store(path: Path) -> str | None:
    """Return the kind that a Zarr names, such as ``"nearfar capture"``; None if it names none."""
    try:
        metadata = json.loads((path / METADATA).read_bytes())
        return str(metadata["attributes"]["format"])
    except (OSError, ValueError, RecursionError, KeyError, TypeError):
        return None
