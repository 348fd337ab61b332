"""From a scene's description to its exact transport at native size."""

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeVar

import numpy as np
from scipy import sparse

from nearfar.arrays import Size
from nearfar.parallel import side_by_side
from nearfar.scenes.form_factors import exchange
from nearfar.scenes.geometry import Scene
from nearfar.scenes.native.direct import Rows, as_matrices, direct_rows, lit_by
from nearfar.scenes.native.interpolation import patch_grid
from nearfar.scenes.native.near import dipoles_between
from nearfar.scenes.native.points import bands, points_of
from nearfar.scenes.native.sizes import patch_size
from nearfar.scenes.native.weights import Nodes, node_weights, nodes_of
from nearfar.scenes.optics import Pinhole, pinhole
from nearfar.scenes.patches import Patches, albedo, build_patches, with_medium
from nearfar.scenes.radiosity import bounced, reflection_factor
from nearfar.scenes.rays import Surface, surface
from nearfar.scenes.render import SAMPLES_PER_SIDE, WHITE_LEVEL, subsurface_of
from nearfar.transport.exact_operator import ExactOperator
from nearfar.transport.mediated import DenseBetween, Mediated

# Sub-rays of the camera, about, and the most along each side of its pixels.
CAMERA_RAYS = 10_000_000
CAMERA_SAMPLES = 4
# Sub-rays of the projector along the shorter side, at least; and the most where it has fewer
# pixels.
PROJECTOR_RAYS_ALONG = 256
PROJECTOR_RAYS = 4_000_000

Traced = TypeVar("Traced")


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
    nodes = nodes_of(scene.parts, patch_grid(patches, len(scene.parts), eye, coarse))
    progress("direct light", 0.1)
    seen = _camera_side(everything, nodes, (eye, projector), (lens, camera))
    progress("light that falls", 0.3)
    fallen = _projector_side(everything, nodes, (eye, projector))
    progress("form factors", 0.4)
    far = Mediated(seen.far, fallen.far, _bounces(scene, patches))
    near, body = None, nodes.body
    if body is not None:
        between = dipoles_between(body.lattice, body.sources, body.entering)
        near = Mediated(seen.near, fallen.near, between)
    operator = ExactOperator(projector, camera, seen.direct, near, far, scene.name)
    floodlit = operator.pictures(np.ones((1, *projector), dtype=np.float32))
    progress("inter-reflections", 1.0)
    return operator * (WHITE_LEVEL / float(floodlit.max()))


class _Side(NamedTuple):
    """What the camera sees, or the light that falls from the projector."""

    direct: tuple[sparse.csr_array, ...]
    near: sparse.csr_array
    far: sparse.csr_array


def _camera_side(
    everything: Surface,
    nodes: Nodes,
    projector: tuple[Pinhole, Size],
    camera: tuple[Pinhole, Size],
) -> _Side:
    lens, size = camera
    coaxial = bool(np.all(lens.position == projector[0].position))
    samples = min(CAMERA_SAMPLES, max(1, int(np.sqrt(CAMERA_RAYS / size.pixels))))

    def trace(rows: slice) -> tuple[Rows, sparse.csr_array, sparse.csr_array]:
        points = points_of(everything, lens, size, samples, rows)
        lit = lit_by(points, everything, projector, coaxial=coaxial)
        direct = direct_rows(
            points[lit], nodes.parts, projector, camera, samples=samples, rows=rows
        )
        share = np.full(len(points), 1 / samples**2)
        return direct, *node_weights(points, share, lit, nodes, _pixels(rows, size))

    direct, near, far = zip(*_in_bands(trace, bands(size, samples)), strict=True)
    matrices = as_matrices(direct, projector[1].pixels)
    return _Side(matrices, sparse.vstack(near, "csr"), sparse.vstack(far, "csr"))


def _projector_side(everything: Surface, nodes: Nodes, projector: tuple[Pinhole, Size]) -> _Side:
    eye, size = projector
    most = max(1, int(np.sqrt(PROJECTOR_RAYS / size.pixels)))
    samples = min(most, -(-PROJECTOR_RAYS_ALONG // min(size)))

    def trace(rows: slice) -> tuple[sparse.csr_array, sparse.csr_array]:
        points = points_of(everything, eye, size, samples, rows)
        points = points[np.einsum("nx,nx->n", points.direction, points.normal) < 0]
        lit = np.ones(len(points), dtype=bool)
        pixels = _pixels(rows, size)
        return node_weights(points, points.solid_angle, lit, nodes, pixels)

    near, far = zip(*_in_bands(trace, bands(size, samples)), strict=True)
    return _Side((), sparse.vstack(near, "csr"), sparse.vstack(far, "csr"))


def _pixels(rows: slice, size: Size) -> slice:
    return slice(rows.start * size.width, rows.stop * size.width)


def _in_bands(trace: Callable[[slice], Traced], rows: Sequence[slice]) -> list[Traced]:
    """Trace bands of rows side by side."""
    found: dict[int, Traced] = {}

    def fill(number: int) -> None:
        found[number] = trace(rows[number])

    side_by_side(fill, range(len(rows)))
    return [found[number] for number in range(len(rows))]


def _bounces(scene: Scene, patches: Patches) -> DenseBetween:
    """Return F between patches: from the light that falls to far-range radiosity."""
    occluders = surface(scene.parts, [i for i, part in enumerate(scene.parts) if part.occludes])
    form = exchange(patches, scene.parts, occluders)
    translucent = np.flatnonzero(with_medium(patches, scene.parts))
    inside = subsurface_of(patches, scene.parts, translucent)
    reflected = albedo(patches, scene.parts)
    channels = reflected.shape[1]
    matrices = np.empty((channels, len(patches), len(patches)), dtype=np.float32)
    for channel in range(channels):
        factor = reflection_factor(
            reflected[:, channel], patches, translucent, inside[channel] if inside else None
        )
        matrices[channel] = bounced(form.copy(), factor)
    return DenseBetween(matrices)
