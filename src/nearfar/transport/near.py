"""Near-range transport: a W x W window of projector pixels around the rounded q.

Index convention: c runs over camera pixels, w over the W x W offsets of
`nearfar.illumination.centred_basis.window_offsets`.
"""

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Size, beside
from nearfar.illumination.centred_basis import window_offsets


def centre(correspondence: Floats, projector: Size) -> NDArray[np.int64]:
    """Round q to whole projector pixels, shape (C, 2); (0, 0) where there is no direct light."""
    q = np.nan_to_num(np.asarray(correspondence).reshape(-1, 2), nan=0.0)
    return np.clip(np.rint(q), 0, np.array(projector) - 1).astype(np.int64)


def line_through(q: Floats, projector: Size) -> int:
    """Row of the projector nearest to one q, shape (2,); the middle one without direct light."""
    lit = bool(np.isfinite(q).all())
    return int(centre(q, projector)[0, 0]) if lit else projector.height // 2


def inside(centres: NDArray[np.int64], window: int, projector: Size) -> Booleans:
    """Return whether each window entry lies on the projector, shape (C, W^2)."""
    side = beside(np.arange(window) - window // 2, centres)
    rows = centres[:, 0, None] + side
    columns = centres[:, 1, None] + side
    rows_in = (rows >= 0) & (rows < projector.height)
    columns_in = (columns >= 0) & (columns < projector.width)
    both: Booleans = rows_in[:, :, None] & columns_in[:, None, :]
    return both.reshape((len(centres), window**2))


def places_on(centres: NDArray[np.int64], window: int, projector: Size) -> NDArray[np.int64]:
    """Flat projector pixels (C, W^2) of the window entries; 0 for those beyond the border."""
    places = centres[:, None, :] + window_offsets(window)
    flat = places[..., 0] * projector.width + places[..., 1]
    return np.asarray(np.where(inside(centres, window, projector), flat, 0))


def _places(centres: NDArray[np.int64], window: int, projector: Size) -> NDArray[np.int64]:
    """Flat places (C, W^2) of the window entries on a projector with a border of W."""
    y, x = (centres + window).T
    dy, dx = window_offsets(window).T
    width = projector.width + 2 * window
    return np.asarray((y * width + x)[:, None] + (dy * width + dx)[None, :])


def look_up(light: Floats, centres: NDArray[np.int64], window: int, projector: Size) -> Floats:
    """Read a light (Py, Px) over every window, shape (C, W^2); 0 beyond the border."""
    return read(pad(light.reshape(projector), window), centres, window)


def pad(lights: Floats, window: int) -> Floats:
    """Lay a dark border of W around lights (..., Py, Px), for `read`."""
    return np.pad(lights, [(0, 0)] * (lights.ndim - 2) + [(window, window)] * 2)


def read(padded: Floats, centres: NDArray[np.int64], window: int) -> Floats:
    """Read one padded light over every window, shape (C, W^2)."""
    views = np.lib.stride_tricks.sliding_window_view(padded, (window, window))
    first = centres + window - window // 2
    return np.asarray(views[first[:, 0], first[:, 1]].reshape(len(centres), -1))


def reached(padded: Booleans, centres: NDArray[np.int64], window: int) -> Booleans:
    """Return whether any pixel of a padded light (bool) is lit in each window, shape (C,)."""
    counts = np.pad(np.cumsum(np.cumsum(padded, axis=0), axis=1), [(1, 0), (1, 0)])
    y, x = (centres + window - window // 2).T
    inside = counts[y + window, x + window] + counts[y, x]
    return np.asarray(inside > counts[y, x + window] + counts[y + window, x])


def spread(values: Floats, centres: NDArray[np.int64], window: int, projector: Size) -> Floats:
    """Adjoint of `look_up`: scatter window values (C, W^2) over the projector, (Py, Px)."""
    height, width = projector.height + 2 * window, projector.width + 2 * window
    places = _places(centres, window, projector).ravel()
    padded = np.bincount(places, weights=values.ravel(), minlength=height * width)
    on_projector = padded.reshape(height, width)[window:-window, window:-window]
    return np.asarray(on_projector, dtype=np.float64)
