"""What a simulated scene is made of: parts with a material each, seen from one or two pinholes.

World units are metres, y points up. Directions and positions are arrays [..., 3] as (x, y, z).

Functions that make a mesh import trimesh themselves: it is slow to import, and a scene is described
without it.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nearfar.arrays import Floats, Integers

Vector = tuple[float, float, float]

# Triangles smaller than this (square metres) are rounding where curves meet in a point.
SMALLEST_AREA = 1e-12


@dataclass(frozen=True)
class Gloss:
    """A clear coat: a normalised Blinn-Phong lobe seen under direct light only.

    Attributes
    ----------
    reflectance : float
        Share of the light that the lobe reflects, 0 to 1.
    exponent : float
        Sharpness of the lobe.
    """

    reflectance: float
    exponent: float


@dataclass(frozen=True)
class Medium:
    """A translucent inside, for the dipole of Jensen et al. (2001).

    Attributes
    ----------
    scattering, absorption : tuple of float
        Reduced scattering and absorption per metre, for red, green and blue.
    index : float
        Refractive index relative to air.
    """

    scattering: Vector
    absorption: Vector
    index: float


@dataclass(frozen=True, eq=False)
class Material:
    """How a surface reflects.

    Attributes
    ----------
    albedo : tuple of float
        Diffuse albedo of the surface, for red, green and blue.
    gloss, medium : Gloss or None, Medium or None
        Clear coat and translucent inside.
    texture : callable or None
        Factor on the albedo at positions (..., 3), shape (...); of mean about one. Light under a
        surface has the factor's root where it enters and where it leaves.
    """

    albedo: Vector
    gloss: Gloss | None = None
    medium: Medium | None = None
    texture: Callable[[Floats], Floats] | None = None


@dataclass(frozen=True, eq=False)
class Part:
    """One smooth piece of surface.

    Attributes
    ----------
    name : str
        What it is.
    vertices : ndarray, shape (V, 3), float64
        In metres.
    faces : ndarray, shape (F, 3), int64
        Corners of the triangles, counter-clockwise from outside.
    material : Material
    occludes : bool
        Whether it can hide other parts from each other; the walls of a convex room cannot.
    """

    name: str
    vertices: Floats
    faces: Integers
    material: Material
    occludes: bool = True


@dataclass(frozen=True)
class View:
    """A pinhole that looks at a point.

    Attributes
    ----------
    position, target : tuple of float
        The pinhole, and the point at the centre of the field of view.
    half_tangent : float
        Tangent of half the field of view, along the longer side of the pattern grid.
    """

    position: Vector
    target: Vector
    half_tangent: float


@dataclass(frozen=True)
class Scene:
    """A scene in front of a projector and a camera.

    Attributes
    ----------
    name : str
    parts : tuple of Part
    projector_view : View
    camera_view : View or None
        None where the camera shares the projector's pinhole and field of view.
    """

    name: str
    parts: tuple[Part, ...]
    projector_view: View
    camera_view: View | None


def quadrilateral(name: str, corner: Vector, along: Vector, up: Vector, material: Material) -> Part:
    """Make a flat wall of a convex room, from a corner and two edges; it faces ``along x up``."""
    start, first, second = (np.asarray(vector, dtype=float) for vector in (corner, along, up))
    corners = np.stack([start, start + first, start + first + second, start + second])
    return Part(name, corners, np.array([[0, 1, 2], [0, 2, 3]]), material, occludes=False)


def solid(name: str, mesh: Any, material: Material, *, move: Vector = (0.0, 0.0, 0.0)) -> Part:
    """Make a part that hides others, from a `trimesh.Trimesh`, moved by `move`."""
    vertices = np.asarray(mesh.vertices, dtype=float) + np.asarray(move)
    return Part(name, vertices, np.asarray(mesh.faces, dtype=np.int64), material)


def lathe(profile: Any, *, sections: int = 192) -> Any:
    """Surface of revolution about the y axis.

    Parameters
    ----------
    profile : array_like, shape (n, 2)
        Radius and height. The surface faces the right-hand side of the way along the profile
        (outwards where the way leads up).
    sections : int
        Number of facets around.

    Returns
    -------
    trimesh.Trimesh
    """
    radius, height = np.asarray(profile, dtype=float).T
    angle = 2 * np.pi * np.arange(sections) / sections
    vertices = np.stack(
        np.broadcast_arrays(
            radius[:, None] * np.sin(angle), height[:, None], radius[:, None] * np.cos(angle)
        ),
        axis=-1,
    ).reshape(-1, 3)
    ring, around = np.meshgrid(np.arange(len(radius) - 1), np.arange(sections), indexing="ij")
    low, following = ring * sections, (around + 1) % sections
    corners = np.stack(
        [low + around, low + following, low + sections + following, low + sections + around], -1
    )
    return _tiled(vertices, corners)


def sheet(curves: Any) -> Any:
    """Surface through curves side by side.

    Parameters
    ----------
    curves : array_like, shape (n, m, 3)
        Points of each curve. The surface faces ``along the curve x to the next curve``.

    Returns
    -------
    trimesh.Trimesh
    """
    points = np.asarray(curves, dtype=float)
    number = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape[:2])
    corners = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], -1)
    return _tiled(points, corners)


def box(low: Vector, high: Vector) -> Any:
    """Box between two opposite corners, sides along the axes, as a `trimesh.Trimesh`."""
    import trimesh

    return trimesh.creation.box(bounds=[low, high])


def ball(radius: float | Vector, *, subdivisions: int = 5) -> Any:
    """Sphere or ellipsoid about the origin, as a `trimesh.Trimesh`."""
    import trimesh

    mesh = trimesh.creation.icosphere(subdivisions=subdivisions)
    mesh.apply_transform(np.diag([*np.broadcast_to(radius, 3), 1.0]))
    return mesh


def tube(start: Vector, end: Vector, radius: float) -> Any:
    """Capsule between two points, as a `trimesh.Trimesh`."""
    import trimesh

    first, last = np.asarray(start), np.asarray(end)
    height = float(np.linalg.norm(last - first))
    mesh = trimesh.creation.capsule(height=height, radius=radius, count=[48, 48])
    mesh.apply_translation([0, 0, -mesh.bounds.mean(axis=0)[2]])
    turned: Any = trimesh.geometry.align_vectors([0, 0, 1], last - first)  # type: ignore[no-untyped-call]
    mesh.apply_transform(turned)
    mesh.apply_translation((first + last) / 2)
    return mesh


def ring(major: float, minor: float) -> Any:
    """Torus in the xy plane about the origin, as a `trimesh.Trimesh`."""
    import trimesh

    return trimesh.creation.torus(major, minor, major_sections=96, minor_sections=32)


def rotation(angle: float, axis: Vector, *, point: Vector = (0.0, 0.0, 0.0)) -> Floats:
    """Matrix (4, 4) that turns by an angle (radians) about an axis through a point."""
    import trimesh

    turn: Any = trimesh.transformations.rotation_matrix(angle, axis, point)  # type: ignore[no-untyped-call]
    return np.asarray(turn)


def transformed(part: Part, matrix: Floats) -> Part:
    """Apply a matrix (4, 4) to the corners of a part."""
    import trimesh

    return replace(part, vertices=trimesh.transform_points(part.vertices, matrix))


def _tiled(points: Floats, corners: Integers) -> Any:
    """Mesh of quadrilaterals (..., 4), numbers of points (..., 3); empty ones are left out."""
    import trimesh

    corners = corners.reshape(-1, 4)
    faces = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    mesh = trimesh.Trimesh(points.reshape(-1, 3), faces, process=False)
    mesh.update_faces(mesh.area_faces > SMALLEST_AREA)
    return mesh
