"""Changes to the metadata of Zarr stores, as if they had been written so."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from nearfar.files.checksums import CHECKSUM


def change_metadata(file: Path, change: Callable[[dict[str, Any]], object]) -> None:
    """Change a ``zarr.json`` and take its checksum away, as older files have none."""
    metadata = json.loads(file.read_text())
    change(metadata)
    if isinstance(metadata.get("attributes"), dict):
        metadata["attributes"].pop(CHECKSUM, None)
    file.write_text(json.dumps(metadata))


def change_attributes(store: Path, **changes: object) -> None:
    """Change attributes of a store."""
    change_metadata(store / "zarr.json", lambda metadata: metadata["attributes"].update(changes))
