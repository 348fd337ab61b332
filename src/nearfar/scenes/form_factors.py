"""Exchange of light between patches: G = A_i F_ij, symmetric, with occlusion.

Index convention: i, j are patches, a, b their samples. F_ij is the share of the light that leaves
i and arrives at j; the irradiance at i under radiosities B is sum_j F_ij B_j.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, blocks
from nearfar.parallel import side_by_side
from nearfar.scenes.geometry import Part
from nearfar.scenes.patches import Patches
from nearfar.scenes.rays import SURFACE_OFFSET, Surface, blocked_along

# Pairs nearer than this many of their radii are summed over their samples.
NEAR_RADII = 3.0
# Samples nearer than this many of their sides are taken as parallelograms.
NEAR_SIDES = 1.5
# Form factors below this are zero. Rounding leaves such values between patches in one plane, and
# their products would be subnormal, with which processors compute a hundred times slower. Those of
# 20 000 patches add up to less than the rounding of float32.
LEAST_FORM_FACTOR = 1e-12
# Row sums of form factors are at most this.
MAXIMUM_ROW_SUM = 0.999
# Rays between two patches that something may hide from each other.
RAYS_PER_PAIR = 4
ROWS_AT_ONCE = 256
# Products of samples at once: their arrays stay in the processor's cache.
PRODUCTS_AT_ONCE = 2**15
TOUCHING_AT_ONCE = 2**13
RAYS_AT_ONCE = 2**13


def exchange(patches: Patches, parts: Sequence[Part], occluders: Surface) -> Floats:
    """Form factors of all pairs of patches, times the area.

    Parameters
    ----------
    patches : Patches
    parts : sequence of Part
    occluders : Surface
        Triangles that can hide patches from each other.

    Returns
    -------
    ndarray, shape (n, n), float32
        G_ij = A_i F_ij = A_j F_ji, in square metres; exactly symmetric.
    """
    count = len(patches)
    result = np.zeros((count, count), dtype=np.float32)
    flat = np.array([not part.occludes for part in parts])[patches.part]
    boxes, ends = occluder_boxes(parts), ray_ends(patches)

    def fill(rows: slice) -> None:
        # Only pairs j >= the block's first row; the rest by symmetry.
        columns = slice(rows.start, count)
        block, square = point_exchange(
            patches.centre[rows],
            patches.normal[rows],
            patches.area[rows],
            other_position=patches.centre[columns],
            other_normal=patches.normal[columns],
            other_area=patches.area[columns],
        )
        reach = NEAR_RADII * (patches.radius[rows, None] + patches.radius[columns])
        apart = ~(flat[rows, None] & (patches.part[rows, None] == patches.part[columns]))
        i, j = np.nonzero((square < reach**2) & apart)
        block[i, j] = refined(i + rows.start, j + columns.start, patches)
        smaller = np.minimum(patches.area[rows, None], patches.area[columns])
        block[block < LEAST_FORM_FACTOR * smaller] = 0
        if boxes:
            shadowed = block > 0
            shadowed &= crosses_any(patches.centre[rows], patches.centre[columns], boxes)
            i, j = np.nonzero(shadowed)
            block[i, j] *= visible_share(i + rows.start, j + columns.start, ends, occluders)
        # Inside the block both halves were computed: keep one.
        inner = block[:, : len(block)]
        block[:, : len(block)] = np.triu(inner) + np.triu(inner, 1).T
        result[rows, columns] = block
        result[columns, rows] = block.T

    side_by_side(fill, blocks(count, ROWS_AT_ONCE))
    return _at_most_all(result, patches.area)


def _at_most_all(form: Floats, area: Floats) -> Floats:
    """Scale rows of form factors down to `MAXIMUM_ROW_SUM`, symmetrically and in place.

    Where parts run into each other a sliver may be counted with more than its true area.
    """
    total = form.sum(axis=1) / area
    limit = (MAXIMUM_ROW_SUM / np.maximum(total, MAXIMUM_ROW_SUM)).astype(np.float32)
    for rows in blocks(len(form), ROWS_AT_ONCE):
        form[rows] *= np.minimum(limit[rows, None], limit)
    return form


def point_exchange(
    position: Floats,
    normal: Floats,
    area: Floats,
    *,
    other_position: Floats,
    other_normal: Floats,
    other_area: Floats,
) -> tuple[Floats, Floats]:
    """Compute the exchange between small areas: cos cos' / (pi r^2) times both areas.

    Parameters
    ----------
    position, normal : ndarray, shape (..., a, 3)
    area : ndarray, shape (..., a)
    other_position, other_normal, other_area : ndarray, shapes (..., b, 3) and (..., b)

    Returns
    -------
    exchange : ndarray, shape (..., a, b), float64
        A_a F_ab without occlusion.
    square : ndarray, shape (..., a, b), float64
        Squared distances.
    """

    def product(first: Floats, second: Floats) -> Floats:
        return np.asarray(first @ np.swapaxes(second, -1, -2))

    def own(first: Floats, second: Floats) -> Floats:
        return np.asarray(np.einsum("...x,...x->...", first, second))

    square = product(-2 * position, other_position)
    square += own(position, position)[..., :, None]
    square += own(other_position, other_position)[..., None, :]
    np.maximum(square, 0, out=square)
    leaving = product(normal, other_position)
    leaving -= own(normal, position)[..., :, None]
    arriving = product(position, other_normal)
    arriving -= own(other_normal, other_position)[..., None, :]
    result = np.maximum(leaving, 0, out=leaving)
    result *= np.maximum(arriving, 0, out=arriving)
    result *= area[..., :, None]
    result *= other_area[..., None, :]
    result /= np.pi * square**2 + 1e-30
    return result, square


def refined(i: Integers, j: Integers, patches: Patches) -> Floats:
    """Exchange of pairs of patches, summed over their samples; shape (pairs,).

    Samples too near for points are taken as parallelograms.
    """
    result = np.empty(len(i))
    nothing = np.empty(0, dtype=np.int64)
    touching: list[tuple[Integers, Integers, Integers]] = [(nothing, nothing, nothing)]
    for pairs, a_count, b_count in _alike(patches.counts[i], patches.counts[j]):
        a, b = i[pairs], j[pairs]
        left, right = slice(a_count), slice(b_count)
        value, square = point_exchange(
            patches.positions[a, left],
            patches.normals[a, left],
            patches.areas[a, left],
            other_position=patches.positions[b, right],
            other_normal=patches.normals[b, right],
            other_area=patches.areas[b, right],
        )
        reach = patches.sides[a, left, None] + patches.sides[b, None, right]
        reach *= NEAR_SIDES
        pair, s, t = np.nonzero(square < reach**2)
        value[pair, s, t] = 0
        result[pairs] = value.sum(axis=(-1, -2))
        touching.append((pairs[pair], s, t))
    pair, s, t = (np.concatenate(indices) for indices in zip(*touching, strict=True))
    for some in blocks(len(pair), TOUCHING_AT_ONCE):
        at = pair[some]
        value = touching_exchange((i[at], s[some]), (j[at], t[some]), patches)
        np.add.at(result, at, value)
    return result


def _alike(first: Integers, second: Integers) -> Iterator[tuple[Integers, int, int]]:
    """Yield groups of pairs with the same two numbers of samples, and these numbers."""
    order = np.lexsort((second, first))
    changes = (np.diff(first[order]) != 0) | (np.diff(second[order]) != 0)
    for group in np.split(order, np.flatnonzero(changes) + 1):
        if len(group):
            a_count, b_count = int(first[group[0]]), int(second[group[0]])
            for part in blocks(len(group), PRODUCTS_AT_ONCE // (a_count * b_count)):
                yield group[part], a_count, b_count


def touching_exchange(
    first: tuple[Integers, Integers], second: tuple[Integers, Integers], patches: Patches
) -> Floats:
    """Exchange of samples that may touch, from the smaller's middle to the larger's parallelogram.

    Parameters
    ----------
    first, second : tuple of ndarray of int, shape (pairs,)
        Patch and sample.
    patches : Patches

    Returns
    -------
    ndarray, shape (pairs,)
    """
    swap = patches.areas[first] > patches.areas[second]
    point = (np.where(swap, second[0], first[0]), np.where(swap, second[1], first[1]))
    shape = (np.where(swap, first[0], second[0]), np.where(swap, first[1], second[1]))
    return patches.areas[point] * point_to_parallelogram(point, shape, patches)


def point_to_parallelogram(
    point: tuple[Integers, Integers], shape: tuple[Integers, Integers], patches: Patches
) -> Floats:
    """Form factor from the middle of a sample to the parallelogram of another (Lambert 1760).

    One over 2 pi times the sum over the edges of the angle they subtend, times the cosine
    between the point's normal and the normal of the plane through edge and point, after the
    shape is cut off at the point's horizon.
    """
    # Coordinates come first from here on: each is one contiguous array.
    position, normal = patches.positions[point].T, np.ascontiguousarray(patches.normals[point].T)
    along, up = np.ascontiguousarray(np.moveaxis(patches.edges[shape], 0, -1)) / 2
    way = patches.positions[shape].T - position
    corners = [way - along - up, way + along - up, way + along + up, way - along + up]
    heights = [_dot(corner, normal) for corner in corners]
    total = np.zeros(way.shape[1])
    leaves, enters = np.zeros_like(way), np.zeros_like(way)
    for this, following in zip(range(4), (1, 2, 3, 0), strict=True):
        start, end = corners[this], corners[following]
        low, high = heights[this], heights[following]
        slope = np.where(low == high, 1.0, low - high)
        crossing = start + low / slope * (end - start)
        down, rising = (low >= 0) & (high < 0), (low < 0) & (high >= 0)
        leaves, enters = np.where(down, crossing, leaves), np.where(rising, crossing, enters)
        start, end = np.where(rising, crossing, start), np.where(down, crossing, end)
        total += np.where((low >= 0) | (high >= 0), _edge(start, end, normal), 0)
    total += _edge(leaves, enters, normal)
    facing = _dot(way, patches.normals[shape].T) < 0
    return np.where(facing, np.maximum(total, 0), 0) / (2 * np.pi)


def _edge(start: Floats, end: Floats, normal: Floats) -> Floats:
    """Angle between two points seen from the origin, times the cosine to the edge's plane."""
    (sx, sy, sz), (ex, ey, ez) = start, end
    crossed = np.stack([ey * sz - ez * sy, ez * sx - ex * sz, ex * sy - ey * sx])
    sine = np.sqrt(_dot(crossed, crossed))
    angle = np.arctan2(sine, _dot(start, end))
    return np.asarray(angle * _dot(crossed, normal) / np.maximum(sine, 1e-30))


def _dot(first: Floats, second: Floats) -> Floats:
    """Scalar products of vectors, (3, n) each."""
    product = first * second
    return np.asarray(product[0] + product[1] + product[2])


def ray_ends(patches: Patches) -> tuple[Floats, Floats]:
    """Where rays from and to each patch end, and the normals there, (RAYS_PER_PAIR, n, 3) each."""
    every = np.arange(len(patches))
    samples = [
        (2 * turn + 1) * patches.counts // (2 * RAYS_PER_PAIR) for turn in range(RAYS_PER_PAIR)
    ]
    normals = np.stack([patches.normals[every, sample] for sample in samples])
    positions = np.stack([patches.positions[every, sample] for sample in samples])
    return positions + SURFACE_OFFSET * normals, normals


def visible_share(
    i: Integers, j: Integers, ends: tuple[Floats, Floats], occluders: Surface
) -> Floats:
    """Share of a few rays between pairs of patches that nothing blocks; shape (pairs,)."""
    share = np.empty(len(i))
    points, normals = ends
    for pairs in blocks(len(i), RAYS_AT_ONCE):
        first, second = i[pairs], j[pairs]
        facing, visible = np.zeros(len(first)), np.zeros(len(first))
        for turn in range(RAYS_PER_PAIR):
            # Samples in opposite order, so that the rays differ from parallel ones.
            other = (turn * 3 + 1) % RAYS_PER_PAIR
            start = points[turn].take(first, axis=0)
            way = points[other].take(second, axis=0)
            way -= start
            # What lies below a horizon is left out of the exchange already.
            above = np.einsum("nx,nx->n", way, normals[turn].take(first, axis=0)) > 0
            above &= np.einsum("nx,nx->n", way, normals[other].take(second, axis=0)) < 0
            facing += above
            # Hardly a ray lies below: following it costs less than picking out the others.
            visible += above & ~blocked_along(occluders, start, way)
        share[pairs] = visible / np.maximum(facing, 1)
    return share


def occluder_boxes(parts: Sequence[Part]) -> list[tuple[Floats, Floats]]:
    """Boxes (lowest, highest corner) around the parts that occlude, overlapping ones joined."""
    boxes: list[tuple[Floats, Floats]] = []
    for part in parts:
        if not part.occludes:
            continue
        low, high = part.vertices.min(axis=0), part.vertices.max(axis=0)
        apart = []
        for box in boxes:
            if np.all(low <= box[1]) and np.all(box[0] <= high):
                low, high = np.minimum(low, box[0]), np.maximum(high, box[1])
            else:
                apart.append(box)
        boxes = [*apart, (low, high)]
    return boxes


def crosses_any(start: Floats, end: Floats, boxes: Sequence[tuple[Floats, Floats]]) -> Booleans:
    """Whether the segments between points (a, 3) and (b, 3) meet a box, shape (a, b)."""
    origin, target = start.astype(np.float32), end.astype(np.float32)
    hits = np.zeros((len(start), len(end)), dtype=bool)
    inverse = []
    for axis in range(3):
        way = target[None, :, axis] - origin[:, None, axis]
        # A segment within a plane of the box: any tiny slope will do.
        inverse.append(1 / np.where(np.abs(way) < 1e-7, np.float32(1e-7), way))
    for low, high in boxes:
        enter = np.zeros(hits.shape, dtype=np.float32)
        leave = np.ones(hits.shape, dtype=np.float32)
        for axis in range(3):
            first = np.float32(low[axis] - SURFACE_OFFSET) - origin[:, None, axis]
            last = np.float32(high[axis] + SURFACE_OFFSET) - origin[:, None, axis]
            one, two = first * inverse[axis], last * inverse[axis]
            np.maximum(enter, np.minimum(one, two), out=enter)
            np.minimum(leave, np.maximum(one, two), out=leave)
        hits |= enter <= leave
    return hits
