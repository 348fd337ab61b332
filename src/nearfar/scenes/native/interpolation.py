"""Smooth weights of patches at points between their centres.

Index convention: m points, n patches. Weights are at least 0 and add up to 1. Only patches of the
point's own part count, so that nothing is mixed across a seam; where the projector sees the point
they are those under the four nearest pixels of the patches' grid, bilinearly, and elsewhere the
nearest ones.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from nearfar.arrays import Booleans, Floats, Integers, Size
from nearfar.scenes.native.points import Spots
from nearfar.scenes.optics import Pinhole, place_of
from nearfar.scenes.patches import Patches

# Patches that a point without light of the projector's is between.
NEAREST = 7
# A patch counts where its plane passes the point at less than this share of the distance, so that
# front and back of a thin part are not mixed.
LARGEST_RISE = 0.6


@dataclass(frozen=True, eq=False)
class PatchGrid:
    """Patches with what finds those next to a point.

    Attributes
    ----------
    patches : Patches
    eye : Pinhole
        The projector's.
    size : Size
        Grid of the patches.
    slots : ndarray, shape (parts, pixels), int64
        Lit patch of each part under each pixel of the grid; -1 where there is none.
    trees : tuple
        Of each part, the numbers of its patches and a tree of their centres.
    """

    patches: Patches
    eye: Pinhole
    size: Size
    slots: Integers
    trees: tuple[tuple[Integers, cKDTree], ...]


def patch_grid(patches: Patches, parts: int, eye: Pinhole, size: Size) -> PatchGrid:
    """Prepare patches for `weights_at`."""
    slots = np.full((parts, size.pixels), -1, dtype=np.int64)
    lit = np.flatnonzero(patches.pixel >= 0)
    slots[patches.part[lit], patches.pixel[lit]] = lit
    every = np.arange(len(patches))
    trees = []
    for part in range(parts):
        # A sliver on a coarse grid may have no patch of its own.
        mine = np.flatnonzero(patches.part == part)
        chosen = mine if len(mine) else every
        trees.append((chosen, cKDTree(patches.centre[chosen])))
    return PatchGrid(patches, eye, size, slots, tuple(trees))


def weights_at(spots: Spots, grid: PatchGrid, seen: Booleans) -> tuple[Integers, Floats]:
    """Return patches and weights at points.

    Parameters
    ----------
    spots : Spots
        The m points.
    grid : PatchGrid
    seen : ndarray, shape (m,), bool
        Which points the projector sees.

    Returns
    -------
    patch : ndarray, shape (m, k), int64
    weight : ndarray, shape (m, k), float64
        0 where fewer than k patches count.
    """
    patch = np.zeros((len(spots), NEAREST), dtype=np.int64)
    weight = np.zeros((len(spots), NEAREST))
    patch[:, :4], weight[:, :4] = _between_four(spots, grid)
    weight[~seen] = 0
    total = weight.sum(axis=1)
    left = np.flatnonzero(total < 1e-3)
    weight /= np.maximum(total, 1e-3)[:, None]
    for part in np.unique(spots.part[left]):
        mine = left[spots.part[left] == part]
        chosen, tree = grid.trees[part]
        count = min(NEAREST, len(chosen))
        distance, number = tree.query(spots.position[mine], k=count, workers=-1)
        distance, number = distance.reshape(-1, count), number.reshape(-1, count)
        found = chosen[number]
        share = np.maximum(1 - distance / np.maximum(distance[:, -1:], 1e-9), 0) ** 2
        share *= _beside(spots.position[mine], spots.normal[mine], grid.patches, found)
        share[:, 0] += 1e-6
        patch[mine] = 0
        patch[mine, :count] = found
        weight[mine] = 0
        weight[mine, :count] = share / share.sum(axis=1, keepdims=True)
    return patch, weight


def _between_four(spots: Spots, grid: PatchGrid) -> tuple[Integers, Floats]:
    """Lit patches of the part under the four nearest pixels, with bilinear weights."""
    y, x, _ = place_of(grid.eye, grid.size, spots.position)
    y, x = y - 0.5, x - 0.5
    top, left = np.floor(y), np.floor(x)
    patches, weights = [], []
    for below in (0, 1):
        for beside in (0, 1):
            row, column = top + below, left + beside
            inside = (row >= 0) & (row < grid.size.height)
            inside &= (column >= 0) & (column < grid.size.width)
            pixel = np.where(inside, row * grid.size.width + column, 0).astype(np.int64)
            patch = grid.slots[spots.part, pixel]
            inside &= patch >= 0
            share = np.maximum(1 - np.abs(y - row), 0) * np.maximum(1 - np.abs(x - column), 0)
            patches.append(np.where(inside, patch, 0))
            weights.append(np.where(inside, share, 0.0))
    patch, weight = np.stack(patches, axis=-1), np.stack(weights, axis=-1)
    return patch, weight * _beside(spots.position, spots.normal, grid.patches, patch)


def _beside(position: Floats, normal: Floats, patches: Patches, patch: Integers) -> Booleans:
    """Whether points lie on the same piece of surface as patches (m, k)."""
    way = position[:, None] - patches.centre[patch]
    rise = np.abs(np.einsum("mkx,mkx->mk", way, patches.normal[patch]))
    facing = np.einsum("mx,mkx->mk", normal, patches.normal[patch]) > 0
    # Rounding at a patch's own centre is no rise.
    return np.asarray(facing & (rise <= LARGEST_RISE * np.linalg.norm(way, axis=-1) + 1e-4))
