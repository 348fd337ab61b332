"""Transports of some rows of the camera: cut out of one, and put together again."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from nearfar.transport.model import Transport

# What each camera pixel has its own of.
FACTORS = ("correspondence", "direct", "near", "far", "black", "noise")
BELIEVED = ("kind", "strength", "white", "offset_noise", "light_noise", "share_of_white")


def of_rows(transport: Transport, rows: slice) -> Transport:
    """Return the transport of some rows of the camera, as views."""
    belief = transport.belief
    if belief is not None:
        belief = replace(belief, **{name: getattr(belief, name)[rows] for name in BELIEVED})
    factors = {name: getattr(transport, name)[rows] for name in FACTORS}
    return replace(transport, belief=belief, **factors)


def stacked(parts: Sequence[Transport]) -> Transport:
    """Put transports of blocks of camera rows together, in order; provenance is the last's."""
    if len(parts) == 1:
        return parts[0]

    def joined(owners: Sequence[Any], names: Sequence[str]) -> dict[str, Any]:
        return {name: np.concatenate([getattr(one, name) for one in owners]) for name in names}

    belief = parts[-1].belief
    if belief is not None:
        belief = replace(belief, **joined([part.belief for part in parts], BELIEVED))
    return replace(parts[-1], belief=belief, **joined(parts, FACTORS))
