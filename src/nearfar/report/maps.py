"""Maps of a transport: a value for each camera pixel.

Saturated camera pixels have no value, and so no say in the colour scale; they are marked.

Index convention: maps are over camera pixels [y, x]; channels are averaged.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Floats
from nearfar.errors import InputError
from nearfar.estimate.error_bars import ErrorBars
from nearfar.illumination.pictures import natural_picture, white
from nearfar.transport.model import Transport

# Titles for readers, by name.
TITLES = {
    "column": "projector column of q",
    "row": "projector row of q",
    "confidence": "confidence in q",
    "picture-error": "relit picture over its error",
    "error": "floodlit picture over its error",
    "direct-error": "direct light over its error",
    "noise": "floodlit picture over a measurement's noise",
    "near-share": "near-range share of the floodlit picture",
    "far-share": "far-range share of the floodlit picture",
    "saturated": "saturated under white",
}
# How to read each.
READINGS = {
    "column": "Which projector column lights the camera pixel directly. It should change smoothly, "
    "with steps only where one surface hides another.",
    "row": "The same for the projector's rows.",
    "confidence": "1: the photos show one place on the projector. Low values are common on dark "
    "surfaces and at edges; direct and near-range light are unsure there.",
    "picture-error": "Signal over one standard deviation, under a natural picture: 20 dB is an "
    "error of 10 %, 40 dB of 1 %. Dark patches relight worst.",
    "error": "The same under white. White is photographed itself, many times, so it is surer than "
    "any other light.",
    "direct-error": "The same of the direct light alone. It is less sure than relit pictures where "
    "direct and near-range light can hardly be told apart.",
    "noise": "Light under white over the noise of one measurement: the camera's noise, not the "
    "estimate's error. The paper's estimate has no error bars.",
    "near-share": "How much of the light comes from projector pixels close by: high on skin, wax "
    "and marble, low on opaque surfaces.",
    "far-share": "How much of the light came by way of other surfaces: high in shadows and "
    "creases.",
    "saturated": "1: at full scale under white in one channel or more. What was estimated there "
    "is wrong; expose less.",
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
    reading : str
        How to read it, a sentence or two.
    saturated : ndarray of bool, shape (y, x), optional
        Camera pixels that have no value as they are saturated.
    """

    title: str
    unit: str
    low: float
    high: float
    values: Floats
    reading: str = ""
    saturated: Booleans | None = None


def maps_of(transport: Transport) -> Mapping[str, Callable[[], Map]]:
    """Return the maps that a transport has data for, by name, as functions that compute them."""
    height, width = transport.projector
    q = transport.correspondence
    quality = transport.quality
    saturated = None if quality is None else quality.saturated

    def plain(name: str, unit: str, high: float, values: Floats) -> Map:
        values = values.astype(np.float32)
        if saturated is not None:
            values[saturated] = np.nan
        return Map(TITLES[name], unit, 0.0, high, values, READINGS[name], saturated)

    def ratio(name: str, signal: Floats, error: Floats) -> Map:
        found = plain(name, "dB", 1.0, _decibels(signal, error))
        low, high = _range(found.values, 1, 99)
        return found._replace(low=low, high=max(high, low + 1))

    def share(name: str, component: int) -> Map:
        found = plain(name, "%", 1.0, _share(transport, component))
        return found._replace(high=float(np.clip(_range(found.values, 0, 99)[1], 1.0, 100.0)))

    def relit(light: Floats) -> Floats:
        return (transport @ light).reshape(*transport.camera, -1)

    def over_error(name: str, light: Floats) -> Map:
        error = ErrorBars(transport).picture(light).reshape(*transport.camera, -1)
        return ratio(name, relit(light), error)

    floodlight = white(transport.projector)
    maps: dict[str, Callable[[], Map]] = {}
    if "direct" in transport.parts:
        maps["column"] = lambda: plain("column", "px", max(1, width - 1), q[..., 1])
        maps["row"] = lambda: plain("row", "px", max(1, height - 1), q[..., 0])
    if quality is not None and "near" in transport.parts:
        maps["confidence"] = lambda: plain("confidence", "", 1.0, quality.confidence)
    if transport.has_error_bars:
        maps["picture-error"] = lambda: over_error(
            "picture-error", natural_picture(transport.projector, 1)
        )
        maps["error"] = lambda: over_error("error", floodlight)
    elif transport.noise.any():
        maps["noise"] = lambda: ratio("noise", relit(floodlight), transport.noise)
    if transport.has_error_bars and "direct" in transport.parts:
        maps["direct-error"] = lambda: ratio(
            "direct-error", transport.direct, ErrorBars(transport).direct()
        )
    if "near" in transport.parts:
        maps["near-share"] = lambda: share("near-share", 1)
    if "far" in transport.parts:
        maps["far-share"] = lambda: share("far-share", 2)
    if quality is not None:
        maps["saturated"] = lambda: Map(
            TITLES["saturated"],
            "",
            0.0,
            1.0,
            quality.saturated.astype(np.float32),
            READINGS["saturated"],
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


def _decibels(values: Floats, errors: Floats) -> Floats:
    """Return the ratio of mean squares over channels, in dB; NaN where there is none."""
    signal, error = (np.mean(part.astype(np.float64) ** 2, axis=-1) for part in (values, errors))
    with np.errstate(divide="ignore", invalid="ignore"):
        decibels = 10 * np.log10(signal / error)
    decibels[~np.isfinite(decibels)] = np.nan
    return np.asarray(decibels)


def _share(transport: Transport, component: int) -> Floats:
    """Return the share of a component in the floodlit picture, in percent; NaN without light."""
    parts = transport.components(white(transport.projector))
    sums = np.stack([part.reshape(*transport.camera, -1).sum(axis=-1) for part in parts])
    with np.errstate(divide="ignore", invalid="ignore"):
        total = sums.sum(axis=0)
        share = 100 * sums[component] / total
    share[(total <= 0) | ~np.isfinite(share)] = np.nan
    return np.asarray(share)


def _range(values: Floats, low: float, high: float) -> tuple[float, float]:
    """Return two percentiles of the values that there are; 0 and 1 if there are none."""
    finite = values[np.isfinite(values)]
    first, last = np.percentile(finite, [low, high]) if finite.size else (0.0, 1.0)
    return float(first), float(last)
