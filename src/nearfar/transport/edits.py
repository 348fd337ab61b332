"""Edits of a transport after it was reconstructed, as its provenance keeps them.

The entry ``edits`` lists them in the order in which they were made, so that nobody takes an edited
transport for what photos showed.
"""

from collections.abc import Mapping
from typing import Any

EDITS = "edits"


def edits_of(provenance: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the edits that a provenance keeps; none if it keeps none.

    Raises
    ------
    TypeError
        If what it keeps are no edits.
    """
    kept = provenance.get(EDITS, [])
    if not isinstance(kept, list) or not all(isinstance(edit, dict) for edit in kept):
        raise TypeError(f"{kept!r} are no edits")
    return list(kept)


def with_edit(provenance: Mapping[str, Any], edit: Mapping[str, Any]) -> dict[str, Any]:
    """Return the provenance of a transport after one edit more, which is of JSON types."""
    return {**provenance, EDITS: [*edits_of(provenance), dict(edit)]}
