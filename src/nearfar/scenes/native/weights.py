"""Weights of the nodes in the scene, in pixels of the camera and of the projector.

The nodes of F are patches, and those of N a lattice around the translucent body. A pixel's weight
of a patch is the patch's share of the pixel, or the light that the pixel sends there, times the
tone at the point over that of the patch. The tone of an opaque surface is its texture; that of a
translucent one is the texture's root, which light under the surface has where it enters and leaves.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import sparse

from nearfar.arrays import Booleans, Floats, Integers
from nearfar.scenes.dipole import dipole
from nearfar.scenes.geometry import Part
from nearfar.scenes.native.interpolation import PatchGrid, weights_at
from nearfar.scenes.native.near import Lattice, step_of
from nearfar.scenes.native.points import Points, spots_of, texture_at
from nearfar.scenes.patches import texture as mean_texture
from nearfar.transport.dipole import Dipole

# Cells within which points of a pixel are taken together, per step of the lattice.
CELLS_PER_STEP = 2


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


def translucent_body(parts: Sequence[Part]) -> Body | None:
    """Return the translucent parts of a scene, which are of one material; None without any."""
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


class Nodes(NamedTuple):
    """The nodes in a scene.

    Attributes
    ----------
    parts : sequence of Part
    grid : PatchGrid
    tone : ndarray, shape (n,)
        Of each patch.
    body : Body or None
        None where nothing is translucent.
    """

    parts: Sequence[Part]
    grid: PatchGrid
    tone: Floats
    body: Body | None


def nodes_of(parts: Sequence[Part], grid: PatchGrid) -> Nodes:
    """Return the nodes in a scene, its patches and a lattice around its translucent body."""
    body, texture = translucent_body(parts), mean_texture(grid.patches, parts)
    return Nodes(parts, grid, _tone(texture, grid.patches.part, body), body)


def _tone(texture: Floats, part: Integers, body: Body | None) -> Floats:
    """Return the tone of some parts where their texture is known, shape (m,)."""
    return texture if body is None else np.where(body.is_body[part], np.sqrt(texture), texture)


def node_weights(
    points: Points, weight: Floats, seen: Booleans, nodes: Nodes, pixels: slice
) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Return the weights of the nodes of N and of F in consecutive pixels.

    Parameters
    ----------
    points : Points
        What the sub-rays of the pixels hit.
    weight : ndarray, shape (m,)
        Of each point: its share of the pixel, or the light that falls there.
    seen : ndarray, shape (m,), bool
        Whether the projector sees it.
    nodes : Nodes
    pixels : slice

    Returns
    -------
    near, far : scipy.sparse.csr_array, shape (pixels, nodes), float32
    """
    texture = texture_at(nodes.parts, points.part, points.position)
    tone = _tone(texture, points.part, nodes.body)
    spots, tones, share = spots_of(points, weight, weight * tone, seen, len(nodes.parts))
    patch, mixed = weights_at(spots, nodes.grid, share > 0.5)
    mixed *= tones[:, None] / nodes.tone[patch]
    count = pixels.stop - pixels.start
    far = _rows(spots.pixel - pixels.start, patch, mixed, (count, len(nodes.tone)))
    if nodes.body is None:
        nothing = np.zeros((0, 1), dtype=np.int64)
        return _rows(nothing[:, 0], nothing, nothing.astype(float), (count, 0)), far
    mine = nodes.body.is_body[points.part]
    return _near_weights(points[mine], (weight * tone)[mine], pixels, nodes.body.lattice), far


def _near_weights(
    points: Points, weight: Floats, pixels: slice, lattice: Lattice
) -> sparse.csr_array:
    """Return the weights of a lattice's nodes in consecutive pixels."""
    # Points of a pixel are taken together within cells finer than the lattice.
    cell = lattice.cells_at(points.position, CELLS_PER_STEP)
    pixel, position, total = _merged(points, cell, weight)
    node, spline = lattice.weights_at(position)
    spline *= total[:, None].astype(np.float32)
    count = pixels.stop - pixels.start
    matrix = _rows(pixel - pixels.start, node, spline, (count, lattice.nodes))
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
