"""Pinholes: the rays through the pixels of a grid, and the pixel that a point falls on.

A grid of H x W pixels fills the field of view; pixel (0, 0) is at the top left. Each pixel has
s x s sub-rays through the centres of its s x s cells.
"""

from dataclasses import dataclass

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, Size
from nearfar.scenes.geometry import View


@dataclass(frozen=True, eq=False)
class Pinhole:
    """A pinhole with its field of view.

    Attributes
    ----------
    position : ndarray, shape (3,)
    axes : ndarray, shape (3, 3)
        Unit vectors to the right, up and forward, as rows.
    half : ndarray, shape (2,)
        Tangents of half the field of view, upwards and to the right.
    """

    position: Floats
    axes: Floats
    half: Floats


def pinhole(view: View, aspect: Size) -> Pinhole:
    """Return the pinhole of a view, its field of view shaped like the grid `aspect`."""
    position = np.asarray(view.position, dtype=float)
    forward = np.asarray(view.target) - position
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(right, forward), forward])
    return Pinhole(position, axes, view.half_tangent * np.asarray(aspect) / max(aspect))


def sub_rays(
    eye: Pinhole, size: Size, samples: int, rows: slice | None = None
) -> tuple[Floats, Floats, Integers]:
    """Return the rays through the s x s cells of every pixel.

    Parameters
    ----------
    eye : Pinhole
    size : Size
        The grid of pixels over the field of view.
    samples : int
        s, cells along each side of a pixel.
    rows : slice, optional
        Consecutive rows of pixels, whose pixels are numbered from 0; all if left out.

    Returns
    -------
    directions : ndarray, shape (n, 3)
        Unit vectors, n = H s W s for all rows, row by row of the fine grid.
    solid_angle : ndarray, shape (n,)
        Of each cell, in steradians (cell area on the plane at distance 1, times cos^3).
    pixel : ndarray, shape (n,), int64
        The pixel of each cell.
    """
    height, width = size.height * samples, size.width * samples
    first, last, _ = (rows or slice(None)).indices(size.height)
    fine_rows = np.arange(first * samples, last * samples)
    up = eye.half[0] * (1 - (2 * fine_rows + 1) / height)
    right = eye.half[1] * ((2 * np.arange(width) + 1) / width - 1)
    plane = np.stack(
        np.broadcast_arrays(right[None, :], up[:, None], np.ones((len(up), width))), axis=-1
    ).reshape(-1, 3)
    length = np.linalg.norm(plane, axis=-1)
    cell = 4 * eye.half[0] * eye.half[1] / (height * width)
    pixel = (fine_rows // samples - first)[:, None] * size.width + np.arange(width) // samples
    return (plane / length[:, None]) @ eye.axes, cell / length**3, pixel.ravel()


def place_of(eye: Pinhole, size: Size, position: Floats) -> tuple[Floats, Floats, Booleans]:
    """Find where points (n, 3) fall on the grid: y, x, and whether they are in view.

    Pixel i reaches from i to i + 1.
    """
    right, up, forward = eye.axes @ (position - eye.position).T
    with np.errstate(divide="ignore", invalid="ignore"):
        y = (1 - up / forward / eye.half[0]) * size.height / 2
        x = (1 + right / forward / eye.half[1]) * size.width / 2
    inside = (forward > 0) & (y >= 0) & (y < size.height) & (x >= 0) & (x < size.width)
    return y, x, inside


def moved(eye: Pinhole, size: Size, position: Floats, way: Floats) -> tuple[Floats, Floats]:
    """Return how far points (n, 3) move on the grid, in y and x, by short ways (n, 3) in space."""
    right, up, forward = eye.axes @ (position - eye.position).T
    to_right, upwards, onwards = eye.axes @ way.T
    per_tangent = np.asarray(size) / (2 * eye.half)
    y = per_tangent[0] * (up * onwards - upwards * forward) / forward**2
    x = per_tangent[1] * (to_right * forward - right * onwards) / forward**2
    return y, x


def pixel_of(eye: Pinhole, size: Size, position: Floats) -> tuple[Integers, Booleans]:
    """Find the pixel that points (n, 3) fall on, shape (n,), and whether they are in view."""
    y, x, inside = place_of(eye, size, position)
    y, x = np.floor(y), np.floor(x)
    flat = np.where(inside, y * size.width + x, 0).astype(np.int64)
    return flat, inside
