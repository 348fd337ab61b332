"""Maps of a transport: a value for each camera pixel.

Index convention: maps are over camera pixels [y, x]; channels are averaged.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats
from nearfar.errors import InputError
from nearfar.estimate.joint import ErrorBars
from nearfar.transport.model import Transport

# What maps are called by people, by name.
TITLES = {
    "column": "projector column of q",
    "row": "projector row of q",
    "confidence": "confidence in q",
    "error": "floodlit picture over its error",
    "direct-error": "direct light over its error",
    "noise": "floodlit picture over a measurement's noise",
    "near-share": "near-range share of the floodlit picture",
    "far-share": "far-range share of the floodlit picture",
    "saturated": "saturated under white",
}


class Map(NamedTuple):
    """A value for each camera pixel.

    Attributes
    ----------
    title, unit : str
    low, high : float
        Ends of its scale.
    values : ndarray, shape (y, x), float32
        NaN where there is none.
    """

    title: str
    unit: str
    low: float
    high: float
    values: Floats


def maps_of(transport: Transport) -> Mapping[str, Callable[[], Map]]:
    """Return what can be mapped of a transport, by name; each is computed when it is called."""
    height, width = transport.projector
    q = transport.correspondence
    found: dict[str, Callable[[], Map]] = {
        "column": lambda: Map(TITLES["column"], "px", 0, max(1, width - 1), q[..., 1]),
        "row": lambda: Map(TITLES["row"], "px", 0, max(1, height - 1), q[..., 0]),
    }
    quality = transport.quality
    if quality is not None:
        found["confidence"] = lambda: Map(
            TITLES["confidence"], "", 0, 1, quality.confidence.astype(np.float32)
        )
    if transport.posterior is not None:
        found["error"] = lambda: _ratio(TITLES["error"], _floodlit(transport), _error(transport))
        found["direct-error"] = lambda: _ratio(
            TITLES["direct-error"], transport.direct, ErrorBars(transport).direct()
        )
    else:
        found["noise"] = lambda: _ratio(TITLES["noise"], _floodlit(transport), transport.noise)
    found["near-share"] = lambda: _share(transport, 1, TITLES["near-share"])
    found["far-share"] = lambda: _share(transport, 2, TITLES["far-share"])
    if quality is not None:
        found["saturated"] = lambda: Map(
            TITLES["saturated"], "", 0, 1, quality.saturated.astype(np.float32)
        )
    return found


def map_named(maps: Mapping[str, Callable[[], Map]], name: str) -> Map:
    """Compute a map.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    if name not in maps:
        raise InputError(f"there is no map {name!r}: choose one of {', '.join(maps)}.")
    return maps[name]()


def _floodlit(transport: Transport) -> Floats:
    light = np.ones(transport.projector, dtype=np.float32)
    return (transport @ light).reshape(*transport.camera, -1)


def _error(transport: Transport) -> Floats:
    light = np.ones(transport.projector, dtype=np.float32)
    return ErrorBars(transport).picture(light).reshape(*transport.camera, -1)


def _ratio(title: str, values: Floats, errors: Floats) -> Map:
    """Map a ratio of mean squares over channels, in dB."""
    power, error = (np.mean(part.astype(np.float64) ** 2, axis=-1) for part in (values, errors))
    with np.errstate(divide="ignore", invalid="ignore"):
        decibels = (10 * np.log10(power / error)).astype(np.float32)
    decibels[~np.isfinite(decibels)] = np.nan
    known = decibels[np.isfinite(decibels)]
    low, high = np.percentile(known, [1, 99]) if known.size else (0.0, 1.0)
    return Map(title, "dB", float(low), float(max(high, low + 1)), decibels)


def _share(transport: Transport, which: int, title: str) -> Map:
    parts = transport.components(np.ones(transport.projector, dtype=np.float32))
    sums = np.stack([part.reshape(*transport.camera, -1).sum(axis=-1) for part in parts])
    with np.errstate(divide="ignore", invalid="ignore"):
        total = sums.sum(axis=0)
        share = (100 * sums[which] / total).astype(np.float32)
    share[(total <= 0) | ~np.isfinite(share)] = np.nan
    known = share[np.isfinite(share)]
    high = float(np.percentile(known, 99)) if known.size else 1.0
    return Map(title, "%", 0.0, float(np.clip(high, 1.0, 100.0)), share)
