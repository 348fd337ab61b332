"""Near-range transport: a W x W window of projector pixels around the rounded q.

Index convention: c runs over camera pixels, w over the W x W offsets of
`nearfar.illumination.centred_basis.window_offsets`.
"""

import numpy as np
from array_api_compat import device
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Size, beside, namespace
from nearfar.illumination.near_basis import NearBasis, window_offsets


def centre(correspondence: Floats, projector: Size) -> NDArray[np.int64]:
    """Return q rounded to whole projector pixels, shape (C, 2); (0, 0) without direct light."""
    q = np.nan_to_num(np.asarray(correspondence).reshape(-1, 2), nan=0.0)
    return np.clip(np.rint(q), 0, np.array(projector) - 1).astype(np.int64)


def line_through(q: Floats, projector: Size) -> int:
    """Return the projector row nearest to one q, shape (2,); the middle row if q is NaN."""
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


def inside_basis(centres: NDArray[np.int64], basis: NearBasis, projector: Size) -> Booleans:
    """Return whether each function of a basis is one that a camera pixel has, (C, J).

    Those of single pixels are left out beyond the border. Others are cut by it, and none is left
    out: (C, 1).
    """
    if basis.pitch == 1:
        return inside(centres, basis.window, projector)
    xp = namespace(centres)
    all_of_them: Booleans = xp.ones((len(centres), 1), dtype=xp.bool, device=device(centres))
    return all_of_them


def window_pixels(centres: NDArray[np.int64], window: int, projector: Size) -> NDArray[np.int64]:
    """Return the flat projector pixel of each window entry, (C, W^2); 0 beyond the border."""
    entries = centres[:, None, :] + window_offsets(window)
    flat = entries[..., 0] * projector.width + entries[..., 1]
    return np.asarray(np.where(inside(centres, window, projector), flat, 0))


def _padded_pixels(centres: NDArray[np.int64], window: int, projector: Size) -> NDArray[np.int64]:
    """Return the flat pixel of each window entry, (C, W^2), on a projector padded by W."""
    y, x = (centres + window).T
    dy, dx = window_offsets(window).T
    width = projector.width + 2 * window
    return np.asarray((y * width + x)[:, None] + (dy * width + dx)[None, :])


def look_up(light: Floats, centres: NDArray[np.int64], window: int, projector: Size) -> Floats:
    """Return a light (Py, Px) over every window, shape (C, W^2); 0 beyond the border."""
    return read(pad(light.reshape(projector), window), centres, window)


def pad(lights: Floats, window: int) -> Floats:
    """Pad lights (..., Py, Px) with a dark border of W, for `read`."""
    return np.pad(lights, [(0, 0)] * (lights.ndim - 2) + [(window, window)] * 2)


def read(padded: Floats, centres: NDArray[np.int64], window: int) -> Floats:
    """Return a padded light over every window, shape (C, W^2)."""
    views = np.lib.stride_tricks.sliding_window_view(padded, (window, window))
    first = centres + window - window // 2
    return np.asarray(views[first[:, 0], first[:, 1]].reshape(len(centres), -1))


def reached(padded: Booleans, centres: NDArray[np.int64], window: int) -> Booleans:
    """Return whether each window has a lit pixel, shape (C,); the padded light is bool."""
    counts = np.pad(np.cumsum(np.cumsum(padded, axis=0), axis=1), [(1, 0), (1, 0)])
    y, x = (centres + window - window // 2).T
    inside = counts[y + window, x + window] + counts[y, x]
    return np.asarray(inside > counts[y, x + window] + counts[y + window, x])


def spread(values: Floats, centres: NDArray[np.int64], window: int, projector: Size) -> Floats:
    """Adjoint of `look_up`: scatter window values (C, W^2) over the projector, (Py, Px)."""
    height, width = projector.height + 2 * window, projector.width + 2 * window
    pixels = _padded_pixels(centres, window, projector).ravel()
    padded = np.bincount(pixels, weights=values.ravel(), minlength=height * width)
    on_projector = padded.reshape(height, width)[window:-window, window:-window]
    return np.asarray(on_projector, dtype=np.float64)
