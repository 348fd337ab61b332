"""A checksum in the metadata of a Zarr store, so that a bit of it that flips is noticed.

Zarr has checksums for chunks alone. That of a ``zarr.json`` lies in its own attributes: it is
replaced together with what it is of, and copied with it. Files written before there were checksums
have none and are read as they are.
"""

import json
import zlib
from typing import Any

# Key of the attribute.
CHECKSUM = "crc32"


class ChecksumError(Exception):
    """Metadata that are not those that were written."""


def with_checksum(metadata: bytes) -> bytes:
    """Return the text of a ``zarr.json`` with its checksum among the attributes."""
    found, _ = _taken_apart(json.loads(metadata))
    found["attributes"] = {**found["attributes"], CHECKSUM: _checksum(found)}
    return json.dumps(found, indent=2).encode()


def without_checksum(metadata: bytes) -> bytes:
    """Return the text of a ``zarr.json`` without its checksum, if it has one.

    Raises
    ------
    ChecksumError
        If the checksum is not that of the text.
    ValueError, RecursionError
        If the text is no JSON.
    """
    loaded = json.loads(metadata)
    if not isinstance(loaded, dict) or not isinstance(loaded.get("attributes"), dict):
        # Zarr says what is wrong with it.
        return metadata
    found, checksum = _taken_apart(loaded)
    if checksum is None:
        return metadata
    if checksum != _checksum(found):
        raise ChecksumError
    return json.dumps(found).encode()


def _taken_apart(metadata: dict[str, Any]) -> tuple[dict[str, Any], object]:
    attributes = dict(metadata["attributes"])
    checksum = attributes.pop(CHECKSUM, None)
    return {**metadata, "attributes": attributes}, checksum


def _checksum(metadata: dict[str, Any]) -> str:
    # Of what the text says: spaces and the order of keys may change.
    return f"{zlib.crc32(json.dumps(metadata, sort_keys=True).encode()):08x}"
