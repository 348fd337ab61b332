"""Piecewise constant patches: one per projector pixel and part, and coarser ones without light.

Index convention: i, j are patches, p is a projector pixel (flattened row by row). Every patch is
made of a few samples, points with an area, which serve wherever a patch is too large for one
point: in form factors between neighbours, at silhouettes, in visibility.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import trimesh

from nearfar.arrays import Booleans, Floats, Integers, Size
from nearfar.scenes.geometry import Part
from nearfar.scenes.optics import Pinhole, pixel_of, sub_rays
from nearfar.scenes.rays import SURFACE_OFFSET, Surface, blocked, hit

# Smaller cosines count as this, which bounds the area of a surface that one sub-ray grazes.
SMALLEST_COSINE = 0.05
# Side of the cells that unlit surfaces are cut into: in projector pixels, and at most in metres.
CELL_PIXELS = 2.5
LARGEST_CELL = 0.08
# Unlit surfaces have at most about one cell for this many projector pixels, ...
PIXELS_PER_CELL = 8
# ... but may have this many in any case.
FEWEST_CELLS = 300


@dataclass(frozen=True, eq=False)
class Samples:
    """Points on the surfaces, each standing for a little area.

    Attributes
    ----------
    position, normal : ndarray, shape (m, 3), float64
    edges : ndarray, shape (m, 2, 3), float64
        Sides of the parallelogram around the position that the sample stands for, in metres;
        their cross product is the normal times the area.
    area, flux : ndarray, shape (m,), float64
        In square metres, and received from the projector at full white.
    part, pixel : ndarray, shape (m,), int64
        Index of the part, and the projector pixel that lights it (-1: none).
    """

    position: Floats
    normal: Floats
    edges: Floats
    area: Floats
    flux: Floats
    part: Integers
    pixel: Integers


@dataclass(frozen=True, eq=False)
class Patches:
    """All patches of a scene.

    Attributes
    ----------
    centre, normal : ndarray, shape (n, 3), float64
    area, flux, radius : ndarray, shape (n,), float64
        Radius is the largest distance of a sample's far side from the centre.
    part, pixel : ndarray, shape (n,), int64
    positions, normals : ndarray, shape (n, k, 3), float64
        The samples of each patch, filled up with its centre.
    edges : ndarray, shape (n, k, 2, 3), float64
        Sides of the samples' parallelograms.
    sides : ndarray, shape (n, k), float64
        Length of the longer side of each sample's parallelogram.
    areas : ndarray, shape (n, k), float64
        Zero where filled up.
    counts : ndarray, shape (n,), int64
        Number of true samples.
    """

    centre: Floats
    normal: Floats
    area: Floats
    flux: Floats
    radius: Floats
    part: Integers
    pixel: Integers
    positions: Floats
    normals: Floats
    edges: Floats
    sides: Floats
    areas: Floats
    counts: Integers

    def __len__(self) -> int:
        return len(self.area)


def lit_samples(where: Surface, eye: Pinhole, size: Size, samples: int) -> Samples:
    """Return the points that the projector lights, s x s per pixel.

    The projector has the same radiant intensity in all directions, so a sub-ray's flux is its
    solid angle, and the irradiance that it brings is cos(theta) / r^2.
    """
    direction, solid_angle, pixel = sub_rays(eye, size, samples)
    # Shared evenly within a pixel, as a coaxial camera weighs its sub-rays: transport is
    # reciprocal.
    flux = (np.bincount(pixel, solid_angle) / samples**2)[pixel]
    hits = hit(where, eye.position, direction)
    cosine = -np.einsum("nx,nx->n", direction, where.normals[hits.face])
    seen = (hits.face >= 0) & (cosine > 0)
    position, face = hits.position[seen], hits.face[seen]
    distance = np.linalg.norm(position - eye.position, axis=-1)
    area = solid_angle[seen] * distance**2 / np.maximum(cosine[seen], SMALLEST_COSINE)
    normal, part = where.normals[face], where.part[face]
    # Where the sides of a cell of the image plane fall on the surface.
    right, up, forward = eye.axes
    depth = (position - eye.position) @ forward
    cell = 2 * eye.half / (np.asarray(size) * samples)
    edges = np.stack(
        [
            depth[:, None] * (side + direction[seen] * (normal @ side / cosine[seen])[:, None])
            for side in (right * cell[1], up * cell[0])
        ],
        axis=1,
    )
    spanned = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=-1)
    edges *= np.sqrt(area / spanned)[:, None, None]
    return Samples(position, normal, edges, area, flux[seen], part, pixel[seen])


def dark_samples(
    where: Surface, parts: Sequence[Part], eye: Pinhole, size: Size, cell: float
) -> tuple[Samples, Integers]:
    """Return points on the surfaces that the projector does not light, and the patch of each.

    Surfaces are cut by a cubic grid of edge `cell` (metres) into patches, and by one three times
    finer into samples. What lies inside another part is left out.
    """
    subdivide: Callable[..., tuple[Floats, Integers]] = trimesh.remesh.subdivide_to_size
    pieces = [subdivide(part.vertices, part.faces, cell / 4, max_iter=20) for part in parts]
    triangles = np.concatenate([vertices[faces] for vertices, faces in pieces])
    part = np.repeat(np.arange(len(parts)), [len(faces) for _, faces in pieces])
    crossed = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(crossed, axis=-1)
    normal, position = crossed / length[:, None], triangles.mean(axis=1)

    raised = position + SURFACE_OFFSET * normal
    facing = np.einsum("nx,nx->n", normal, eye.position - position) > 0
    lit = facing & pixel_of(eye, size, position)[1]
    lit[lit] = ~blocked(where, raised[lit], np.broadcast_to(eye.position, raised[lit].shape))
    above = hit(where, raised, normal).face
    enclosed = (above >= 0) & (np.einsum("nx,nx->n", where.normals[above], normal) > 0)
    keep = ~lit & ~enclosed
    position, normal, area, part = position[keep], normal[keep], length[keep] / 2, part[keep]

    # The grid is shifted so that no wall lies on the border between two cells; normals keep the
    # two sides of a thin or curved part from sharing a patch.
    coarse = np.floor(position / cell + (0.137, 0.291, 0.413))
    patch = _numbered(part, *coarse.T, *np.rint(1.2 * normal).T)[1]
    fine = np.floor(3 * position / cell + (0.137, 0.291, 0.413))
    first, sample = _numbered(patch, *fine.T)
    # A sample stands on the surface itself, at the piece nearest to the middle: the middle of a
    # curved piece lies below the surface, which would hide it.
    total, mean, _ = _merged(sample, area, position, normal)
    away = np.linalg.norm(position - mean[sample], axis=-1)
    chosen = np.lexsort((away, sample))[np.cumsum(np.bincount(sample)) - np.bincount(sample)]
    position, normal, part = position[chosen], normal[chosen], part[chosen]
    edges = _squares(normal, total)
    dark = np.full(len(first), -1, dtype=np.int64)
    points = Samples(position, normal, edges, total, np.zeros(len(first)), part, dark)
    return points, patch[first]


def build_patches(
    where: Surface, parts: Sequence[Part], eye: Pinhole, size: Size, *, samples: int = 4
) -> Patches:
    """Cut the surfaces of a scene into patches.

    Parameters
    ----------
    where : Surface
        All triangles.
    parts : sequence of Part
    eye, size : Pinhole, Size
        The projector and its pattern grid.
    samples : int
        Sub-rays along each side of a projector pixel.

    Returns
    -------
    Patches
        Lit ones come first, ordered by projector pixel.
    """
    lit = lit_samples(where, eye, size, samples)
    distance = float(np.median(np.linalg.norm(lit.position - eye.position, axis=-1)))
    cell = min(CELL_PIXELS * 2 * float(eye.half.max()) * distance / max(size), LARGEST_CELL)
    edges_of = np.diff(where.triangles, axis=1)
    whole = np.linalg.norm(np.cross(edges_of[:, 0], edges_of[:, 1]), axis=-1).sum() / 2
    budget = max(FEWEST_CELLS, size.pixels / PIXELS_PER_CELL)
    cell = max(cell, float(np.sqrt(max(whole - lit.area.sum(), 0) / budget)))
    dark, dark_patch = dark_samples(where, parts, eye, size, cell)
    lit_patch = np.unique(lit.pixel * len(parts) + lit.part, return_inverse=True)[1]
    patch = np.concatenate([lit_patch, dark_patch + lit_patch.max(initial=-1) + 1])

    def both(name: str) -> Floats:
        return np.concatenate([getattr(lit, name), getattr(dark, name)])

    position, normal, area = both("position"), both("normal"), both("area")
    total, centre, direction = _merged(patch, area, position, normal)
    counts = np.bincount(patch)
    order = np.argsort(patch, kind="stable")
    first = order[np.cumsum(counts) - counts]
    slot = np.empty_like(order)
    slot[order] = np.arange(len(order)) - np.repeat(np.cumsum(counts) - counts, counts)
    shape = (len(counts), int(counts.max()))
    positions = np.broadcast_to(centre[:, None], (*shape, 3)).copy()
    normals = np.broadcast_to(direction[:, None], (*shape, 3)).copy()
    areas = np.zeros(shape)
    edges = np.zeros((*shape, 2, 3))
    edges[patch, slot] = both("edges")
    positions[patch, slot], normals[patch, slot], areas[patch, slot] = position, normal, area
    sides = np.linalg.norm(edges, axis=-1).max(axis=-1)
    offset = np.linalg.norm(positions - centre[:, None], axis=-1)
    return Patches(
        centre=centre,
        normal=direction,
        area=total,
        flux=np.bincount(patch, both("flux")).astype(float),
        radius=(offset + sides / 2).max(axis=1),
        part=both("part")[first].astype(np.int64),
        pixel=both("pixel")[first].astype(np.int64),
        positions=positions,
        normals=normals,
        edges=edges,
        sides=sides,
        areas=areas,
        counts=counts,
    )


def albedo(patches: Patches, parts: Sequence[Part]) -> Floats:
    """Diffuse albedo of the patches, shape (n, 3)."""
    values = np.array([part.material.albedo for part in parts])[patches.part]
    return np.asarray(values * texture(patches, parts)[:, None])


def texture(patches: Patches, parts: Sequence[Part]) -> Floats:
    """Mean factor of the textures on the albedo of the patches, shape (n,)."""
    values = np.ones(len(patches))
    for index, part in enumerate(parts):
        if part.material.texture is not None:
            mine = patches.part == index
            factor = part.material.texture(patches.positions[mine])
            weight = patches.areas[mine] / patches.area[mine, None]
            values[mine] = (factor * weight).sum(axis=1)
    return values


def with_medium(patches: Patches, parts: Sequence[Part]) -> Booleans:
    """Which patches lie on a translucent part, shape (n,)."""
    return np.array([part.material.medium is not None for part in parts])[patches.part]


def _merged(
    group: Integers, area: Floats, position: Floats, normal: Floats
) -> tuple[Floats, Floats, Floats]:
    """Total area, mean position and mean unit normal of points in groups."""
    total = np.bincount(group, area).astype(float)
    mean = np.stack([np.bincount(group, area * axis) for axis in position.T], axis=-1)
    direction = np.stack([np.bincount(group, area * axis) for axis in normal.T], axis=-1)
    length = np.linalg.norm(direction, axis=-1, keepdims=True)
    return total, mean / total[:, None], direction / np.maximum(length, 1e-12)


def _numbered(*columns: Floats | Integers) -> tuple[Integers, Integers]:
    """Find distinct rows of integer columns: where each occurs first, and each row's number.

    Columns are packed into one, which sorts far quicker than rows.
    """
    packed = np.zeros(len(columns[0]), dtype=np.int64)
    for column in columns:
        whole = np.asarray(column).astype(np.int64)
        whole = whole - whole.min(initial=0)
        packed = packed * (whole.max(initial=0) + 1) + whole
    _, first, number = np.unique(packed, return_index=True, return_inverse=True)
    return first, number


def _squares(normal: Floats, area: Floats) -> Floats:
    """Sides (m, 2, 3) of squares of given normal and area."""
    axis = np.eye(3)[np.abs(normal).argmin(axis=-1)]
    first = np.cross(axis, normal)
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    sides = np.stack([first, np.cross(normal, first)], axis=1)
    return np.asarray(np.sqrt(area)[:, None, None] * sides)
