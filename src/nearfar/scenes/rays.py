"""Ray casting on the triangles of a scene, in batches, with Embree."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from nearfar.arrays import Booleans, Floats, Integers
from nearfar.scenes.geometry import Part

# Embree works in float32: ends of a ray stand off the surface by this much (metres).
SURFACE_OFFSET = 2e-4


@dataclass(frozen=True, eq=False)
class Surface:
    """All triangles of some parts.

    Attributes
    ----------
    triangles : ndarray, shape (F, 3, 3), float64
        Corners of each triangle.
    normals : ndarray, shape (F, 3), float64
        Unit normals, outwards.
    shading : ndarray, shape (F, 3, 3), float64
        Smooth normals at each corner, for highlights.
    part : ndarray, shape (F,), int64
        Index of the part.
    closest, occluded : callable
        The ray casters behind `hit` and `blocked`.
    """

    triangles: Floats
    normals: Floats
    shading: Floats
    part: Integers
    closest: Callable[[Floats, Floats], dict[str, Any]]
    occluded: Callable[[Floats, Floats], Integers]


@dataclass(frozen=True, eq=False)
class Hits:
    """First hits of n rays; where `face` is -1 there is none and the rest is undefined.

    Attributes
    ----------
    face : ndarray, shape (n,), int64
    position : ndarray, shape (n, 3), float64
    weights : ndarray, shape (n, 3), float64
        Barycentric coordinates in the triangle.
    """

    face: Integers
    position: Floats
    weights: Floats


def surface(parts: Sequence[Part], indices: Sequence[int]) -> Surface:
    """Gather the triangles of ``parts[i] for i in indices`` for ray casting."""
    triangles = np.concatenate(
        [parts[i].vertices[parts[i].faces] for i in indices] or [np.zeros((0, 3, 3))]
    )
    part = np.repeat(np.asarray(indices, dtype=np.int64), [len(parts[i].faces) for i in indices])
    shading = np.concatenate([_smooth(parts[i]) for i in indices] or [np.zeros((0, 3, 3))])
    normals = _unit(_crossed(triangles))
    scene: Any = EmbreeScene()
    if len(triangles):
        TriangleMesh(
            scene,
            triangles.reshape(-1, 3).astype(np.float32),
            np.arange(3 * len(triangles), dtype=np.int32).reshape(-1, 3),
        )

        # The first query builds the scene's tree: now, before several threads ask at once.
        scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32), output=1)

    def closest(origin: Floats, direction: Floats) -> dict[str, Any]:
        found: dict[str, Any] = scene.run(_single(origin), _single(direction), output=1)
        return found

    def occluded(origin: Floats, way: Floats) -> Integers:
        limit = np.ones(len(origin), dtype=np.float32)
        found: Integers = scene.run(_single(origin), _single(way), limit, query="OCCLUDED")
        return found

    return Surface(triangles, normals, shading, part, closest, occluded)


def hit(where: Surface, origin: Floats, direction: Floats) -> Hits:
    """First hits of rays from `origin` (3,) or (n, 3) along `direction` (n, 3)."""
    start = np.broadcast_to(origin, direction.shape)
    found = where.closest(start, direction)
    face = found["primID"].astype(np.int64)
    u, v = found["u"].astype(float), found["v"].astype(float)
    weights = np.stack([1 - u - v, u, v], axis=-1)
    # From the triangle, in float64: the ray's own parameter is float32.
    position = np.einsum("nk,nkx->nx", weights, where.triangles[face])
    return Hits(face, position, weights)


def blocked(where: Surface, origin: Floats, target: Floats) -> Booleans:
    """Whether a triangle stands between points `origin` and `target`, both (n, 3)."""
    return blocked_along(where, origin, target - origin)


def blocked_along(where: Surface, origin: Floats, way: Floats) -> Booleans:
    """Whether a triangle stands between points `origin` and ``origin + way``, both (n, 3)."""
    if not len(where.triangles) or not len(origin):
        return np.zeros(len(origin), dtype=bool)
    return np.asarray(where.occluded(origin, way) >= 0)


def _crossed(triangles: Floats) -> Floats:
    return np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def _smooth(part: Part) -> Floats:
    """Area-weighted normals at the corners of a part's triangles, shape (F, 3, 3)."""
    total = np.zeros_like(part.vertices)
    crossed = _crossed(part.vertices[part.faces])
    for corner in part.faces.T:
        np.add.at(total, corner, crossed)
    return _unit(total[part.faces])


def _single(values: Floats) -> Floats:
    return np.ascontiguousarray(values, dtype=np.float32)
