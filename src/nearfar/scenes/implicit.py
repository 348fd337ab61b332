"""Smooth shapes where a function of the place is zero: rounded bones, grown together."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.scenes.geometry import Vector

# Steps by which points are brought onto the surface, each by what is left of the distance.
STEPS_ONTO_SURFACE = 3
# Corners of the quadrilateral about an edge of the grid, counter-clockwise seen from its end: how
# many cells they lie back along the two axes after the edge's own.
AROUND_EDGE = np.array([[1, 1], [0, 1], [0, 0], [1, 0]])


class Bone(NamedTuple):
    """A capsule between two points, of another radius at either end.

    Attributes
    ----------
    start, end : tuple of float
    radii : (float, float)
        At start and end.
    """

    start: Vector
    end: Vector
    radii: tuple[float, float]


def grown_together(bones: Sequence[Bone], blend: float) -> Callable[[Floats], Floats]:
    """Return the distance from bones with rounded joints, negative inside.

    Parameters
    ----------
    bones : sequence of Bone
    blend : float
        Length over which joints are rounded.

    Returns
    -------
    callable
        From places (..., 3) to distances (...). Exact for a ball alone, nearly so elsewhere.
    """

    def distance(place: Floats) -> Floats:
        total = np.zeros(place.shape[:-1])
        for start, end, (first, last) in bones:
            way = np.subtract(end, start)
            along = np.clip((place - start) @ way / (way @ way), 0, 1)
            away = np.linalg.norm(place - start - along[..., None] * way, axis=-1)
            total += np.exp(-(away - first - along * (last - first)) / blend)
        return np.asarray(-blend * np.log(np.maximum(total, np.finfo(float).tiny)))

    return distance


def zero_surface(
    distance: Callable[[Floats], Floats], low: Vector, high: Vector, step: float
) -> Any:
    """Mesh of the surface around which a function is negative inside, by surface nets.

    A cell of a grid that the surface crosses has a point, and an edge that it crosses a
    quadrilateral between the points of the four cells about it (Gibson, "Constrained elastic
    surface nets", 1998). Points are then brought onto the surface.

    Parameters
    ----------
    distance : callable
        From places (..., 3) to distances (...), nearly those from the surface.
    low, high : tuple of float
        Opposite corners of a box around the surface.
    step : float
        Edge of a cell.

    Returns
    -------
    trimesh.Trimesh
    """
    import trimesh

    axes = [np.arange(first, last + step, step) for first, last in zip(low, high, strict=True)]
    values = distance(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1))
    crossed = [_crossed_edges(values, axis) for axis in range(3)]
    place, corners = (np.concatenate(parts) for parts in zip(*crossed, strict=True))
    _, number = np.unique(corners, return_inverse=True)
    number = number.reshape(corners.shape)
    count = np.bincount(number.ravel())
    sums = [np.bincount(number.ravel(), np.repeat(along, 4)) for along in place.T]
    points = np.array(low) + step * np.stack(sums, axis=-1) / count[:, None]
    for _ in range(STEPS_ONTO_SURFACE):
        points -= _gradient(distance, points, step / 8) * distance(points)[:, None]
    faces = np.concatenate([number[:, [0, 1, 2]], number[:, [0, 2, 3]]])
    return trimesh.Trimesh(points, faces, process=False)


def _crossed_edges(values: Floats, axis: int) -> tuple[Floats, Integers]:
    """Find the edges along an axis that the surface crosses.

    Returns
    -------
    place : ndarray, shape (m, 3)
        Where it crosses them, in cells.
    corners : ndarray, shape (m, 4), int64
        Numbers of the cells about each, counter-clockwise seen from outside.
    """
    moved = np.moveaxis(values, axis, 0)
    first, second = (np.moveaxis(part, 0, axis) for part in (moved[:-1], moved[1:]))
    edges = np.argwhere((first < 0) != (second < 0))
    before, after = first[tuple(edges.T)], second[tuple(edges.T)]
    place = edges.astype(float)
    place[:, axis] += before / (before - after)
    cells = np.repeat(edges[:, None], 4, axis=1)
    cells[..., [(axis + 1) % 3, (axis + 2) % 3]] -= AROUND_EDGE
    number = np.ravel_multi_index(tuple(np.moveaxis(cells, -1, 0)), values.shape)
    return place, np.where((before < 0)[:, None], number, number[:, ::-1])


def _gradient(distance: Callable[[Floats], Floats], points: Floats, reach: float) -> Floats:
    """Return unit directions (n, 3) in which a distance grows."""
    steps = reach * np.eye(3)
    found = np.stack([distance(points + step) - distance(points - step) for step in steps], -1)
    return np.asarray(found / np.linalg.norm(found, axis=-1, keepdims=True))
