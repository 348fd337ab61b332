"""Select camera pixels of a transport, and join transports of camera rows."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from nearfar.arrays import Integers, middles
from nearfar.errors import InputError
from nearfar.transport.model import Transport
from nearfar.transport.posterior import FreePosterior, PatternPosterior, Posterior
from nearfar.transport.quality import Quality

# Attributes of a transport with a value for each camera pixel.
FACTORS = ("correspondence", "direct", "near", "far", "black", "noise")
# The same, of transports whose functions of near-range light are of several projector pixels.
OPTIONAL_FACTORS = ("footprint", "second_place", "second_direct")
POSTERIOR_FIELDS = (
    "prior_component",
    "prior_scale",
    "white",
    "offset_noise",
    "light_noise",
    "share_of_white",
    "noise_share",
)
QUALITY_FIELDS = ("confidence", "saturated")
PATTERN_POSTERIOR_FIELDS = ("prior_component", "variance_ratio", "black_deviation")
# Attributes that may be None, and by their type their own with a value for each camera pixel.
OPTIONAL_PARTS = ("posterior", "quality")
FIELDS: dict[type, tuple[str, ...]] = {
    Posterior: POSTERIOR_FIELDS,
    PatternPosterior: PATTERN_POSTERIOR_FIELDS,
    FreePosterior: ("variance_ratio",),
    Quality: QUALITY_FIELDS,
}


def of_rows(transport: Transport, rows: slice) -> Transport:
    """Return the transport of some rows of the camera, as views."""
    return _chosen(transport, lambda values: values[rows])


def thinned_blocks(blocks: Iterable[Transport], height: int, step: int) -> Iterator[Transport]:
    """Thin out blocks of camera rows, to the same pixels as thinning the whole camera.

    A block none of whose rows is kept becomes a transport of no rows.

    Parameters
    ----------
    blocks : iterable of Transport
        In order.
    height : int
        Rows of the whole camera.
    step : int
    """
    rows, first = middles(height, step), 0
    for part in blocks:
        stop = first + part.camera.height
        mine = rows[(rows >= first) & (rows < stop)] - first
        yield of_pixels(part, mine, middles(part.camera.width, step))
        first = stop


def of_pixels(transport: Transport, rows: Integers, columns: Integers) -> Transport:
    """Return the transport of the camera pixels in some rows and columns, as a copy."""
    return _chosen(transport, lambda values: values[np.ix_(rows, columns)])


def _chosen(transport: Transport, choose: Callable[[Any], Any]) -> Transport:
    names = [*FACTORS, *_present(transport)]
    changes = {name: choose(getattr(transport, name)) for name in names}
    for part in OPTIONAL_PARTS:
        owner: Any = getattr(transport, part)
        if owner is not None:
            own = {name: choose(getattr(owner, name)) for name in FIELDS[type(owner)]}
            changes[part] = replace(owner, **own)
    return replace(transport, **changes)


def _present(transport: Transport) -> list[str]:
    return [name for name in OPTIONAL_FACTORS if getattr(transport, name) is not None]


def stacked(parts: Sequence[Transport]) -> Transport:
    """Join transports of blocks of camera rows, in order; the provenance is that of the last.

    Raises
    ------
    InputError
        If some have arrays that others lack.
    """
    if len(parts) == 1:
        return parts[0]

    def joined(owners: Sequence[Any], names: Sequence[str]) -> dict[str, Any]:
        return {name: np.concatenate([getattr(one, name) for one in owners]) for name in names}

    present = _present(parts[-1])
    if any(_present(part) != present for part in parts):
        raise InputError(
            "some of the transports have second places or footprints, and others have none: join "
            "parts of one reconstruction."
        )
    changes = joined(parts, (*FACTORS, *present))
    for name in OPTIONAL_PARTS:
        owners: list[Any] = [getattr(part, name) for part in parts]
        if owners[-1] is not None:
            changes[name] = replace(owners[-1], **joined(owners, FIELDS[type(owners[-1])]))
    return replace(parts[-1], **changes)
