"""Transports of some camera pixels: cut out of one, and put together again."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from nearfar.transport.model import Transport

# What each camera pixel has its own of.
FACTORS = ("correspondence", "direct", "near", "far", "black", "noise")
BELIEVED = ("kind", "strength", "white", "offset_noise", "light_noise", "share_of_white")
TRUSTED = ("confidence", "saturated")
# Parts that a transport may lack, and what each camera pixel has of them.
OPTIONAL = {"belief": BELIEVED, "quality": TRUSTED}


def of_rows(transport: Transport, rows: slice) -> Transport:
    """Return the transport of some rows of the camera, as views."""
    return _chosen(transport, lambda values: values[rows])


def thinned(transport: Transport, step: int, first: int = 0) -> Transport:
    """Return the transport of every `step`-th row, from `first`, and column, as a copy."""
    return _chosen(transport, lambda values: values[first::step, ::step].copy())


def thinned_blocks(blocks: Iterable[Transport], step: int) -> Iterator[Transport]:
    """Thin blocks of camera rows out as the whole camera would be; some may be left empty."""
    first = 0
    for part in blocks:
        yield thinned(part, step, -first % step)
        first += part.camera.height


def _chosen(transport: Transport, choose: Callable[[Any], Any]) -> Transport:
    changes = {name: choose(getattr(transport, name)) for name in FACTORS}
    for part, names in OPTIONAL.items():
        owner: Any = getattr(transport, part)
        if owner is not None:
            own = {name: choose(getattr(owner, name)) for name in names}
            changes[part] = replace(owner, **own)
    return replace(transport, **changes)


def stacked(parts: Sequence[Transport]) -> Transport:
    """Put transports of blocks of camera rows together, in order; provenance is the last's."""
    if len(parts) == 1:
        return parts[0]

    def joined(owners: Sequence[Any], names: Sequence[str]) -> dict[str, Any]:
        return {name: np.concatenate([getattr(one, name) for one in owners]) for name in names}

    changes = joined(parts, FACTORS)
    for name, names in OPTIONAL.items():
        owners: list[Any] = [getattr(part, name) for part in parts]
        if owners[-1] is not None:
            changes[name] = replace(owners[-1], **joined(owners, names))
    return replace(parts[-1], **changes)
