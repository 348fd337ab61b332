"""What the sub-rays of a grid's pixels hit, a band of rows at a time."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Self

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, Size, blocks
from nearfar.scenes.geometry import Part
from nearfar.scenes.optics import Pinhole, sub_rays
from nearfar.scenes.rays import Surface, hit

# Sub-rays in a band.
RAYS_AT_ONCE = 2**18


@dataclass(frozen=True, eq=False)
class Points:
    """Where m sub-rays hit the surfaces.

    Attributes
    ----------
    pixel : ndarray, shape (m,), int64
        Pixel of the grid, flattened row by row.
    part : ndarray, shape (m,), int64
    position, normal, direction : ndarray, shape (m, 3), float64
        Normals are those of the triangles; directions unit vectors away from the pinhole.
    shading : ndarray, shape (m, 3), float64
        Smooth normals, of any length.
    solid_angle : ndarray, shape (m,), float64
        Of each sub-ray; evenly shared within a pixel.
    """

    pixel: Integers
    part: Integers
    position: Floats
    normal: Floats
    direction: Floats
    shading: Floats
    solid_angle: Floats

    def __len__(self) -> int:
        return len(self.pixel)

    def __getitem__(self, chosen: Booleans | Integers) -> Self:
        return type(self)(**{each.name: getattr(self, each.name)[chosen] for each in fields(self)})


def bands(size: Size, samples: int) -> list[slice]:
    """Divide the rows of a grid so that each band has a bounded number of sub-rays."""
    return list(blocks(size.height, RAYS_AT_ONCE // (size.width * samples**2)))


def points_of(where: Surface, eye: Pinhole, size: Size, samples: int, rows: slice) -> Points:
    """Return what the s x s sub-rays of the pixels in some rows hit."""
    direction, solid_angle, pixel = sub_rays(eye, size, samples, rows)
    solid_angle = (np.bincount(pixel, solid_angle) / samples**2)[pixel]
    hits = hit(where, eye.position, direction)
    seen = hits.face >= 0
    face = hits.face[seen]
    return Points(
        pixel[seen] + rows.start * size.width,
        where.part[face],
        hits.position[seen],
        where.normals[face],
        direction[seen],
        np.einsum("nk,nkx->nx", hits.weights[seen], where.shading[face]),
        solid_angle[seen],
    )


@dataclass(frozen=True, eq=False)
class Spots:
    """Points of a pixel on one part, taken together; m of them.

    Attributes
    ----------
    pixel, part : ndarray, shape (m,), int64
    position, normal : ndarray, shape (m, 3), float64
        Means.
    weight : ndarray, shape (m,), float64
        Sum of the points' weights.
    """

    pixel: Integers
    part: Integers
    position: Floats
    normal: Floats
    weight: Floats

    def __len__(self) -> int:
        return len(self.pixel)


def spots_of(
    points: Points, weight: Floats, toned: Floats, seen: Booleans, parts: int
) -> tuple[Spots, Floats, Floats]:
    """Take the points of each pixel and part together.

    Parameters
    ----------
    points : Points
    weight, toned : ndarray, shape (m,)
        Weight of each point, and the weight times the texture there.
    seen : ndarray, shape (m,), bool
        Whether the projector sees it.
    parts : int
        Number of parts of the scene.

    Returns
    -------
    spots : Spots
    tones : ndarray
        Sums of `toned`.
    share : ndarray
        Share of each spot's points that the projector sees.
    """
    packed, group = np.unique(points.pixel * parts + points.part, return_inverse=True)
    length = len(packed)
    count = np.bincount(group, minlength=length)

    def mean(values: Floats) -> Floats:
        sums = [np.bincount(group, axis, minlength=length) for axis in values.T]
        return np.asarray(np.stack(sums, axis=-1) / count[:, None])

    spots = Spots(
        packed // parts,
        packed % parts,
        mean(points.position),
        mean(points.normal),
        np.bincount(group, weight, minlength=length).astype(float),
    )
    tones = np.bincount(group, toned, minlength=length).astype(float)
    return spots, tones, np.bincount(group, seen, minlength=length) / count


def texture_at(parts: Sequence[Part], part: Integers, position: Floats) -> Floats:
    """Return the factor of the textures on the albedo at points, shape (m,)."""
    factor = np.ones(len(part))
    for index in np.unique(part):
        texture = parts[index].material.texture
        if texture is not None:
            mine = part == index
            factor[mine] = texture(position[mine])
    return factor
