"""Direct light by ray casting below the camera pixel.

Index convention: c is a camera pixel, p a projector pixel. A sub-ray of the camera stands for a
cell of its pixel; the cell's footprint on the surface, seen from the projector, is taken as a box,
and the light of each projector pixel counts by the share of the box that it covers.
"""

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from nearfar.arrays import Booleans, Floats, Integers, Size
from nearfar.scenes.camera import highlight
from nearfar.scenes.geometry import Part
from nearfar.scenes.native.points import Points, texture_at
from nearfar.scenes.optics import Pinhole, moved, place_of
from nearfar.scenes.patches import SMALLEST_COSINE
from nearfar.scenes.rays import SURFACE_OFFSET, Surface, blocked

# A grazing cell's box has at most this many times the sides of one that faces both pinholes.
LARGEST_STRETCH = 4.0
# Entries of some rows of D (entries, channels), their columns, and how many each row has.
Rows = tuple[Floats, Integers, Integers]
# Smaller shares of a box in a pixel are rounding.
LEAST_SHARE = 2e-3


def lit_by(
    points: Points, where: Surface, projector: tuple[Pinhole, Size], *, coaxial: bool
) -> Booleans:
    """Which points the projector lights, shape (m,)."""
    eye, size = projector
    lit = place_of(eye, size, points.position)[2]
    lit &= np.einsum("nx,nx->n", points.normal, eye.position - points.position) > 0
    if not coaxial:
        raised = points.position[lit] + SURFACE_OFFSET * points.normal[lit]
        lit[lit] = ~blocked(where, raised, np.broadcast_to(eye.position, raised.shape))
    return np.asarray(lit)


def direct_rows(
    points: Points,
    parts: Sequence[Part],
    projector: tuple[Pinhole, Size],
    camera: tuple[Pinhole, Size],
    *,
    samples: int,
    rows: slice,
) -> Rows:
    """Compute D of some rows of camera pixels, from their sub-rays that the projector lights.

    Parameters
    ----------
    points : Points
        What the camera's sub-rays hit, the lit ones alone.
    parts : sequence of Part
    projector, camera : tuple of Pinhole and Size
    samples : int
        s, sub-rays along each side of a camera pixel.
    rows : slice
        Rows of camera pixels.

    Returns
    -------
    data : ndarray, shape (entries, channels), float32
    indices : ndarray, shape (entries,), int32
        Projector pixels.
    counts : ndarray, shape (n,), int64
        Entries of each camera pixel in the rows.
    """
    eye, size = projector
    way = eye.position - points.position
    distance = np.linalg.norm(way, axis=-1)
    cosine = np.einsum("nx,nx->n", way, points.normal) / distance
    irradiance = np.maximum(cosine, SMALLEST_COSINE) / distance**2
    albedo = np.array([part.material.albedo for part in parts])[points.part]
    albedo = albedo * texture_at(parts, points.part, points.position)[:, None]
    lobe = highlight(parts, points.part, points.shading, way, -points.direction)
    value = (albedo + lobe[:, None]) * (irradiance / samples**2)[:, None]
    point, pixel, share = _covered(points, projector, camera, samples)
    first = rows.start * camera[1].width
    count = (rows.stop - rows.start) * camera[1].width
    key = (points.pixel[point] - first) * size.pixels + pixel
    order = np.argsort(key, kind="stable")
    key = key[order]
    starts = np.flatnonzero(np.diff(key, prepend=-1))
    entries = (value[point[order]] * share[order, None]).astype(np.float32)
    data = np.add.reduceat(entries, starts, axis=0) if len(starts) else entries
    row, column = np.divmod(key[starts], size.pixels)
    return data, column.astype(np.int32), np.bincount(row, minlength=count)


def _covered(
    points: Points, projector: tuple[Pinhole, Size], camera: tuple[Pinhole, Size], samples: int
) -> tuple[Integers, Integers, Floats]:
    """Find the projector pixels in the box of each point: point, pixel and share of the box."""
    eye, size = projector
    y, x, _ = place_of(eye, size, points.position)
    height, width = _boxes(points, projector, camera, samples)
    found = []
    top, left = np.floor(y - height / 2), np.floor(x - width / 2)
    every = np.arange(len(points))
    deepest = int(np.ceil(height.max(initial=0))) + 1
    widest = int(np.ceil(width.max(initial=0))) + 1
    for below in range(deepest):
        down = _overlap(top + below, y, height)
        some = np.flatnonzero((down > 0) & (top + below >= 0) & (top + below < size.height))
        for beside in range(widest):
            column = left[some] + beside
            across = _overlap(column, x[some], width[some])
            inside = (across > 0) & (column >= 0) & (column < size.width)
            chosen = some[inside]
            pixel = (top[chosen] + below) * size.width + column[inside]
            found.append((every[chosen], pixel.astype(np.int64), down[chosen] * across[inside]))
    point, pixel, share = (np.concatenate(values) for values in zip(*found, strict=True))
    return point, pixel, share


def _overlap(pixel: Floats, middle: Floats, length: Floats) -> Floats:
    """Share of an interval that lies in a pixel, along one axis."""
    low, high = middle - length / 2, middle + length / 2
    share = (np.minimum(high, pixel + 1) - np.maximum(low, pixel)) / length
    # Rays are cast in float32: what a box has beyond a pixel by rounding is none.
    return np.asarray(np.where(share < LEAST_SHARE, 0, np.where(share > 1 - LEAST_SHARE, 1, share)))


def _boxes(
    points: Points, projector: tuple[Pinhole, Size], camera: tuple[Pinhole, Size], samples: int
) -> tuple[Floats, Floats]:
    """Height and width in projector pixels of the box that each point's cell is taken as.

    It has the variances of the cell's parallelogram on the projector, along either axis.
    """
    eye, size = projector
    lens, photo = camera
    nominal = np.asarray(size) / (np.asarray(photo) * samples)
    right, up, forward = lens.axes
    depth = (points.position - lens.position) @ forward
    cosine = -np.einsum("nx,nx->n", points.direction, points.normal)
    cell = 2 * lens.half / (np.asarray(photo) * samples)
    squares = np.zeros((2, len(points)))
    for side in (right * cell[1], up * cell[0]):
        slope = points.normal @ side / np.maximum(cosine, SMALLEST_COSINE)
        way = depth[:, None] * (side + points.direction * slope[:, None])
        squares += np.square(moved(eye, size, points.position, way))
    lengths = np.sqrt(squares)
    largest = LARGEST_STRETCH * nominal[:, None] * (1 + 0 * lengths)
    height, width = np.clip(lengths, nominal[:, None] / LARGEST_STRETCH, largest)
    return height, width


def as_matrices(pieces: Sequence[Rows], columns: int) -> tuple[sparse.csr_array, ...]:
    """Put rows together as one matrix per channel; they share their indices."""
    data, indices, counts = (np.concatenate(values) for values in zip(*pieces, strict=True))
    starts = np.concatenate([[0], np.cumsum(counts)])
    if starts[-1] < np.iinfo(np.int32).max:
        starts = starts.astype(np.int32)
    return tuple(
        sparse.csr_array(
            (np.ascontiguousarray(data[:, channel]), indices, starts),
            shape=(len(counts), columns),
        )
        for channel in range(data.shape[1])
    )
