"""From a scene's description to its exact transport at native size."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy import sparse

from nearfar.arrays import Booleans, Floats, Integers, Size
from nearfar.scenes.dipole import Dipole, dipole
from nearfar.scenes.form_factors import exchange
from nearfar.scenes.geometry import Part, Scene
from nearfar.scenes.native.direct import as_matrices, direct_rows, lit_by
from nearfar.scenes.native.interpolation import PatchGrid, patch_grid, weights_at
from nearfar.scenes.native.near import Lattice, dipoles_between, step_of
from nearfar.scenes.native.points import (
    Points,
    bands,
    points_of,
    spots_of,
    texture_at,
)
from nearfar.scenes.native.sizes import patch_size
from nearfar.scenes.optics import Pinhole, pinhole
from nearfar.scenes.patches import Patches, albedo, build_patches, texture, with_medium
from nearfar.scenes.radiosity import bounced, reflection_factor
from nearfar.scenes.rays import Surface, surface
from nearfar.scenes.render import SAMPLES_PER_SIDE, WHITE_LEVEL, subsurface_of
from nearfar.transport.exact_operator import ExactOperator
from nearfar.transport.mediated import DenseBetween, Mediated

# Sub-rays of the camera, about, and the most along each side of its pixels.
CAMERA_RAYS = 10_000_000
CAMERA_SAMPLES = 4
# Cells within which points of a pixel are taken together, per step of the lattice.
CELLS_PER_STEP = 2
# Sub-rays of the projector along the shorter side, at least.
PROJECTOR_RAYS = 256


def render_native(
    scene: Scene,
    projector: Size,
    camera: Size,
    *,
    progress: Callable[[str, float], None],
) -> ExactOperator:
    """Compute the transport of a scene as an operator.

    Parameters
    ----------
    scene : Scene
    projector, camera : Size
    progress : callable
        Called with what is being done and the share done, 0 to 1.

    Returns
    -------
    ExactOperator
        In photo units: the brightest camera pixel and channel is 0.9 under full white.
    """
    progress("patches", 0.0)
    everything = surface(scene.parts, range(len(scene.parts)))
    eye = pinhole(scene.projector_view, projector)
    lens = pinhole(scene.camera_view or scene.projector_view, projector)
    coarse = patch_size(projector)
    patches = build_patches(everything, scene.parts, eye, coarse, samples=SAMPLES_PER_SIDE)
    grid = patch_grid(patches, len(scene.parts), eye, coarse)
    body = _body(scene.parts)
    progress("direct light", 0.1)
    seen = _camera_side(scene.parts, everything, (eye, projector), (lens, camera), grid, body)
    progress("light that falls", 0.3)
    fallen = _projector_side(scene.parts, everything, (eye, projector), grid, body)
    progress("form factors", 0.4)
    far = Mediated(seen.far, fallen.far, _bounces(scene, patches))
    near = None
    if body is not None:
        between = dipoles_between(body.lattice, body.sources, body.entering)
        near = Mediated(seen.near, fallen.near, between)
    operator = ExactOperator(projector, camera, seen.direct, near, far, scene.name)
    floodlit = operator.pictures(np.ones((1, *projector), dtype=np.float32))
    progress("inter-reflections", 1.0)
    return operator * (WHITE_LEVEL / float(floodlit.max()))


class Body(NamedTuple):
    """The translucent parts of a scene.

    Attributes
    ----------
    is_body : ndarray, shape (parts,), bool
    lattice : Lattice
    sources : tuple of Dipole
        One per channel.
    entering : tuple of float
        Share of the light that enters, per channel.
    """

    is_body: Booleans
    lattice: Lattice
    sources: tuple[Dipole, ...]
    entering: tuple[float, ...]


def _body(parts: Sequence[Part]) -> Body | None:
    is_body = np.array([part.material.medium is not None for part in parts])
    if not is_body.any():
        return None
    mine = [part for part in parts if part.material.medium is not None]
    material = mine[0].material
    assert material.medium is not None
    corners = np.concatenate([part.vertices for part in mine])
    sources = tuple(dipole(material.medium, i) for i in range(len(material.albedo)))
    lattice = Lattice(corners.min(axis=0), corners.max(axis=0), step_of(sources))
    # What the surface does not reflect enters.
    return Body(is_body, lattice, sources, tuple(1 - value for value in material.albedo))


class _Side(NamedTuple):
    """What the camera sees, or the light that falls from the projector."""

    direct: tuple[sparse.csr_array, ...]
    near: sparse.csr_array
    far: sparse.csr_array


def _camera_side(
    parts: Sequence[Part],
    everything: Surface,
    projector: tuple[Pinhole, Size],
    camera: tuple[Pinhole, Size],
    grid: PatchGrid,
    body: Body | None,
) -> _Side:
    lens, size = camera
    coaxial = bool(np.all(lens.position == projector[0].position))
    samples = min(CAMERA_SAMPLES, max(1, int(np.sqrt(CAMERA_RAYS / size.pixels))))
    direct, near, far = [], [], []
    for rows in bands(size, samples):
        points = points_of(everything, lens, size, samples, rows)
        lit = lit_by(points, everything, projector, coaxial=coaxial)
        direct.append(
            direct_rows(points[lit], parts, projector, camera, samples=samples, rows=rows)
        )
        weight = np.full(len(points), 1 / samples**2)
        n, f = _weights(points, weight, lit, rows, size, parts, grid, body)
        near.append(n)
        far.append(f)
    return _Side(
        as_matrices(direct, projector[1].pixels),
        sparse.vstack(near, "csr"),
        sparse.vstack(far, "csr"),
    )


def _projector_side(
    parts: Sequence[Part],
    everything: Surface,
    projector: tuple[Pinhole, Size],
    grid: PatchGrid,
    body: Body | None,
) -> _Side:
    eye, size = projector
    samples = max(1, -(-PROJECTOR_RAYS // min(size)))
    near, far = [], []
    for rows in bands(size, samples):
        points = points_of(everything, eye, size, samples, rows)
        lit = np.einsum("nx,nx->n", points.direction, points.normal) < 0
        points = points[lit]
        n, f = _weights(points, points.solid_angle, lit[lit], rows, size, parts, grid, body)
        near.append(n)
        far.append(f)
    return _Side((), sparse.vstack(near, "csr"), sparse.vstack(far, "csr"))


def _weights(
    points: Points,
    weight: Floats,
    seen: Booleans,
    rows: slice,
    size: Size,
    parts: Sequence[Part],
    grid: PatchGrid,
    body: Body | None,
) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Return the weights of N's and of F's nodes in the pixels of some rows of a grid."""
    tone = texture_at(parts, points.part, points.position)
    spots, tones, share = spots_of(points, weight, weight * tone, seen, len(parts))
    first, count = rows.start * size.width, (rows.stop - rows.start) * size.width
    patch, mixed = weights_at(spots, grid, share > 0.5)
    mixed *= tones[:, None] / texture(grid.patches, parts)[patch]
    far = _rows(spots.pixel - first, patch, mixed, (count, len(grid.patches)))
    if body is None:
        return sparse.csr_array((count, 0), dtype=np.float32), far
    mine = body.is_body[points.part]
    return _near_weights(points[mine], weight[mine], (first, count), body.lattice), far


def _near_weights(
    points: Points, weight: Floats, pixels: tuple[int, int], lattice: Lattice
) -> sparse.csr_array:
    """Return the weights of a lattice's nodes in pixels, of which the first and the number."""
    first, count = pixels
    # Points of a pixel are taken together within cells finer than the lattice.
    cell = lattice.cells_at(points.position, CELLS_PER_STEP)
    pixel, position, total = _merged(points, cell, weight)
    node, spline = lattice.weights_at(position)
    spline *= total[:, None].astype(np.float32)
    matrix = _rows(pixel - first, node, spline, (count, lattice.nodes))
    matrix.sum_duplicates()
    return matrix


def _merged(points: Points, cell: Integers, weight: Floats) -> tuple[Integers, Floats, Floats]:
    """Take points of one pixel and cell together: pixel, mean position, sum of the weights."""
    cells = int(cell.max(initial=0)) + 1
    packed, group = np.unique(points.pixel * cells + cell, return_inverse=True)
    total = np.bincount(group, weight).astype(float)
    mean = [np.bincount(group, weight * axis) / total for axis in points.position.T]
    return packed // cells, np.stack(mean, axis=-1), total


def _rows(
    row: Integers, column: Integers, weight: Floats, shape: tuple[int, int]
) -> sparse.csr_array:
    """Return a matrix of rows in ascending order, without its zeros."""
    kept = weight != 0
    counts = np.bincount(row, kept.sum(axis=1), minlength=shape[0])
    starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    entries = (weight[kept].astype(np.float32), column[kept].astype(np.int32), starts)
    return sparse.csr_array(entries, shape=shape)


def _bounces(scene: Scene, patches: Patches) -> DenseBetween:
    """Return F between patches: from the light that falls to far-range radiosity."""
    occluders = surface(scene.parts, [i for i, part in enumerate(scene.parts) if part.occludes])
    form = exchange(patches, scene.parts, occluders)
    translucent = np.flatnonzero(with_medium(patches, scene.parts))
    inside = subsurface_of(patches, scene, translucent)
    reflected = albedo(patches, scene.parts)
    channels = reflected.shape[1]
    matrices = np.empty((channels, len(patches), len(patches)), dtype=np.float32)
    for channel in range(channels):
        factor = reflection_factor(
            reflected[:, channel], patches, translucent, inside[channel] if inside else None
        )
        matrices[channel] = bounced(form.copy(), factor)
    return DenseBetween(matrices)
