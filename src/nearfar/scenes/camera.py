"""Shares of patches in each camera pixel, and the highlights on them.

Index convention: c is a camera pixel, i a patch. A camera pixel's value is the mean of the
radiances along its sub-rays, times pi (so that a white patch has its own radiosity).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from nearfar.arrays import Floats, Integers, Size
from nearfar.scenes.geometry import Gloss, Part
from nearfar.scenes.optics import Pinhole, pixel_of, sub_rays
from nearfar.scenes.patches import Patches
from nearfar.scenes.rays import SURFACE_OFFSET, Surface, blocked, hit


@dataclass(frozen=True, eq=False)
class Gather:
    """Two C x n matrices from the light that leaves patches to the camera's pixels.

    Attributes
    ----------
    radiosity : scipy.sparse.csr_array, shape (C, n)
        Shares of the patches in each camera pixel: weights of their radiosities.
    gloss : scipy.sparse.csr_array, shape (C, n)
        Weights of the patches' direct irradiances in their highlights.
    """

    radiosity: sparse.csr_array
    gloss: sparse.csr_array


def gather(
    where: Surface,
    parts: Sequence[Part],
    patches: Patches,
    projector: tuple[Pinhole, Size],
    camera: tuple[Pinhole, Size],
    *,
    samples: int,
) -> Gather:
    """Follow the sub-rays of every camera pixel to the patches.

    Parameters
    ----------
    where : Surface
        All triangles.
    parts : sequence of Part
    patches : Patches
    projector, camera : tuple of Pinhole and Size
    samples : int
        Sub-rays along each side of a camera pixel.

    Returns
    -------
    Gather
    """
    eye, size = camera
    direction, _, pixel = sub_rays(eye, size, samples)
    hits = hit(where, eye.position, direction)
    seen = hits.face >= 0
    face, position, direction = hits.face[seen], hits.position[seen], direction[seen]
    coaxial = bool(np.all(eye.position == projector[0].position))
    patch = _patch_at(where, patches, projector, face, position, coaxial=coaxial)
    weights = np.full(len(patch), 1 / samples**2)
    normal = np.einsum("nk,nkx->nx", hits.weights[seen], where.shading[face])
    lobe = highlight(parts, where.part[face], normal, projector[0].position - position, -direction)
    lobe[patches.pixel[patch] < 0] = 0
    shape = (size.pixels, len(patches))

    def matrix(values: Floats) -> sparse.csr_array:
        result = sparse.csr_array((values, (pixel[seen], patch)), shape=shape)
        result.sum_duplicates()
        result.eliminate_zeros()
        return result

    return Gather(matrix(weights), matrix(weights * lobe))


def _patch_at(
    where: Surface,
    patches: Patches,
    projector: tuple[Pinhole, Size],
    face: Integers,
    position: Floats,
    *,
    coaxial: bool,
) -> Integers:
    """Find the patch at points on the surface, shape (n,).

    Where the projector sees the point it is the patch of that part under that projector pixel;
    elsewhere the nearest patch without light on the same part, or the nearest there is.
    """
    eye, size = projector
    part, normal = where.part[face], where.normals[face]
    raised = position + SURFACE_OFFSET * normal
    pixel, lit = pixel_of(eye, size, position)
    lit &= np.einsum("nx,nx->n", normal, eye.position - position) > 0
    if not coaxial:
        lit[lit] = ~blocked(where, raised[lit], np.broadcast_to(eye.position, raised[lit].shape))
    parts = int(where.part.max()) + 1
    bright = np.flatnonzero(patches.pixel >= 0)
    known = patches.pixel[bright] * parts + patches.part[bright]
    wanted = pixel * parts + part
    slot = np.searchsorted(known, wanted).clip(0, len(known) - 1)
    lit &= known[slot] == wanted
    result = bright[slot]
    for index in np.unique(part[~lit]):
        mine = np.flatnonzero(~lit & (part == index))
        of_part = patches.part == index
        # A sliver on a coarse grid may have no patch of its own.
        masks = (of_part & (patches.pixel < 0), of_part, np.ones(len(patches), dtype=bool))
        choice = next(found for found in map(np.flatnonzero, masks) if len(found))
        result[mine] = choice[cKDTree(patches.centre[choice]).query(position[mine])[1]]
    return np.asarray(result)


def highlight(
    parts: Sequence[Part], part: Integers, normal: Floats, light: Floats, view: Floats
) -> Floats:
    """Blinn-Phong lobe times pi, normalised by (n + 8) / (8 pi); shape (n,)."""
    result = np.zeros(len(part))
    for index in np.unique(part):
        gloss: Gloss | None = parts[index].material.gloss
        if gloss is None:
            continue
        mine = part == index
        half = light[mine] / np.linalg.norm(light[mine], axis=-1, keepdims=True) + view[mine]
        cosine = np.einsum("nx,nx->n", half, normal[mine])
        cosine /= np.linalg.norm(half, axis=-1) * np.linalg.norm(normal[mine], axis=-1)
        lobe = np.maximum(cosine, 0) ** gloss.exponent
        result[mine] = gloss.reflectance * (gloss.exponent + 8) / 8 * lobe
    return result
