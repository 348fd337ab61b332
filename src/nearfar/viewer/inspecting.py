"""What the page shows of one camera pixel, of one projector pixel, and of all of them as maps.

Index convention: rows are over projector pixels [y, x], columns and maps over camera pixels
[y, x]. Channels are averaged.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.errors import InputError
from nearfar.estimate.joint import ErrorBars
from nearfar.illumination.frequencies import grid
from nearfar.transport.model import Transport

# Below this share of its largest value a row's spectrum is not told apart from nothing.
LEAST = 1e-7


class Row(NamedTuple):
    """What one camera pixel answers.

    Attributes
    ----------
    words : dict
        q, k_far, k_near and so on, for JSON.
    window, far : ndarray, shape (Py, Px), float32
        D + N, and F.
    window_error, far_error : ndarray, shape (Py, Px), float32
        Standard deviations of one channel; 0 where the transport does not tell.
    spectrum : ndarray, shape (Py, Px), float32
        |t^| over its largest value in dB, DC in the middle.
    """

    words: dict[str, Any]
    window: Floats
    far: Floats
    window_error: Floats
    far_error: Floats
    spectrum: Floats


def inspect_row(transport: Transport, x: int) -> Row:
    """Tell what a camera pixel answers to each projector pixel.

    Parameters
    ----------
    transport : Transport
        Of one row of the camera.
    x : int
        Column of the camera.
    """
    pixel, projector = slice(x, x + 1), transport.projector
    d, n, f = (part[0].mean(axis=0) for part in transport.component_rows(pixel))
    window, far = (part.reshape(projector) for part in (d + n, f))
    errors = np.zeros((2, *projector), dtype=np.float32)
    if transport.belief is not None:
        d_error, n_error, f_error = ErrorBars(transport).component_rows(pixel)
        together = np.sqrt(d_error[0] ** 2 + n_error[0] ** 2)
        errors[0] = together.mean(axis=0).reshape(projector)
        errors[1] = f_error[0].mean(axis=0).reshape(projector)
    q = transport.correspondence[0, x]
    quality = transport.quality
    words: dict[str, Any] = {
        "q": [float(side) for side in q] if np.isfinite(q).all() else None,
        "window": transport.window,
        "has_errors": transport.belief is not None,
        "confidence": None if quality is None else float(quality.confidence[0, x]),
        "saturated": None if quality is None else bool(quality.saturated[0, x]),
        "noise": float(transport.noise[0, x].mean()),
        "floodlit": {"direct": float(d.sum()), "near": float(n.sum()), "far": float(f.sum())},
        **_bands(transport),
    }
    return Row(words, window, far, errors[0], errors[1], _spectrum(window + far))


def _spectrum(row: Floats) -> Floats:
    size = np.abs(np.fft.fftshift(np.fft.fft2(row)))
    most = max(float(size.max()), float(np.finfo(np.float32).tiny))
    return np.asarray(20 * np.log10(np.maximum(size / most, LEAST)), dtype=np.float32)


def _bands(transport: Transport) -> dict[str, Any]:
    """Tell where far- and near-range light was measured, in cycles per projector pixel."""
    far = np.abs(transport.far_basis.cycles).max(axis=0, initial=0.0)
    if transport.belief is not None:
        measured = [(float(k.fy), float(k.fx)) for k in transport.belief.frequencies]
    else:
        side = Size(transport.window, transport.window)
        measured = [(float(k.fy), float(k.fx)) for k in grid(side, side)]
    beyond = [k for k in measured if abs(k[0]) > far[0] or abs(k[1]) > far[1]]
    # What lies at half a cycle answers direct light alone.
    near = [k for k in beyond if max(map(abs, k)) < 0.5] or [(float(far[0]), float(far[1]))]
    return {
        "k_far": far.tolist(),
        "k_near": np.abs(near).max(axis=0).tolist(),
        "measured": [list(k) for k in measured],
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
        "column": lambda: Map("projector column of q", "px", 0, width - 1, q[..., 1]),
        "row": lambda: Map("projector row of q", "px", 0, height - 1, q[..., 0]),
    }
    quality = transport.quality
    if quality is not None:
        found["confidence"] = lambda: Map(
            "confidence in q", "", 0, 1, quality.confidence.astype(np.float32)
        )
    if transport.belief is not None:
        found["error"] = lambda: _ratio(
            "floodlit picture over its error", _floodlit(transport), _error(transport)
        )
        found["direct-error"] = lambda: _ratio(
            "direct light over its error", transport.direct, ErrorBars(transport).direct()
        )
    else:
        found["noise"] = lambda: _ratio(
            "floodlit picture over a measurement's noise", _floodlit(transport), transport.noise
        )
    found["near-share"] = lambda: _share(transport, 1, "near-range share of the floodlit picture")
    found["far-share"] = lambda: _share(transport, 2, "far-range share of the floodlit picture")
    if quality is not None:
        found["saturated"] = lambda: Map(
            "saturated under white", "", 0, 1, quality.saturated.astype(np.float32)
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
        share = (100 * sums[which] / sums.sum(axis=0)).astype(np.float32)
    share[~np.isfinite(share)] = np.nan
    known = share[np.isfinite(share)]
    high = float(np.percentile(known, 99)) if known.size else 1.0
    return Map(title, "%", 0.0, float(np.clip(high, 1.0, 100.0)), share)
