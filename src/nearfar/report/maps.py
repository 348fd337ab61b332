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

# Titles for readers, by name.
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
    """A map with its scale.

    Attributes
    ----------
    title, unit : str
    low, high : float
        Ends of the colour scale.
    values : ndarray, shape (y, x), float32
        NaN where a camera pixel has no value.
    """

    title: str
    unit: str
    low: float
    high: float
    values: Floats


def maps_of(transport: Transport) -> Mapping[str, Callable[[], Map]]:
    """Return the maps that a transport has data for, by name, as functions that compute them."""
    height, width = transport.projector
    q = transport.correspondence
    maps: dict[str, Callable[[], Map]] = {
        "column": lambda: Map(TITLES["column"], "px", 0, max(1, width - 1), q[..., 1]),
        "row": lambda: Map(TITLES["row"], "px", 0, max(1, height - 1), q[..., 0]),
    }
    quality = transport.quality
    if quality is not None:
        maps["confidence"] = lambda: Map(
            TITLES["confidence"], "", 0, 1, quality.confidence.astype(np.float32)
        )
    if transport.posterior is not None:
        maps["error"] = lambda: _ratio(TITLES["error"], _floodlit(transport), _error(transport))
        maps["direct-error"] = lambda: _ratio(
            TITLES["direct-error"], transport.direct, ErrorBars(transport).direct()
        )
    else:
        maps["noise"] = lambda: _ratio(TITLES["noise"], _floodlit(transport), transport.noise)
    maps["near-share"] = lambda: _share(transport, 1, TITLES["near-share"])
    maps["far-share"] = lambda: _share(transport, 2, TITLES["far-share"])
    if quality is not None:
        maps["saturated"] = lambda: Map(
            TITLES["saturated"], "", 0, 1, quality.saturated.astype(np.float32)
        )
    return maps


def map_named(maps: Mapping[str, Callable[[], Map]], name: str) -> Map:
    """Compute the map of a name.

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
    """Return the map of the ratio of mean squares over channels, in dB."""
    signal, error = (np.mean(part.astype(np.float64) ** 2, axis=-1) for part in (values, errors))
    with np.errstate(divide="ignore", invalid="ignore"):
        decibels = (10 * np.log10(signal / error)).astype(np.float32)
    decibels[~np.isfinite(decibels)] = np.nan
    finite = decibels[np.isfinite(decibels)]
    low, high = np.percentile(finite, [1, 99]) if finite.size else (0.0, 1.0)
    return Map(title, "dB", float(low), float(max(high, low + 1)), decibels)


def _share(transport: Transport, component: int, title: str) -> Map:
    parts = transport.components(np.ones(transport.projector, dtype=np.float32))
    sums = np.stack([part.reshape(*transport.camera, -1).sum(axis=-1) for part in parts])
    with np.errstate(divide="ignore", invalid="ignore"):
        total = sums.sum(axis=0)
        share = (100 * sums[component] / total).astype(np.float32)
    share[(total <= 0) | ~np.isfinite(share)] = np.nan
    finite = share[np.isfinite(share)]
    high = float(np.percentile(finite, 99)) if finite.size else 1.0
    return Map(title, "%", 0.0, float(np.clip(high, 1.0, 100.0)), share)
