"""A camera and a projector before a surface that reflects direct light alone."""

from collections.abc import Callable

import numpy as np
from scipy import sparse

from nearfar.arrays import Size
from nearfar.stereo import StereoCalibration
from nearfar.transport.exact import ExactTransport

# From rays (n, 3) of the camera to depths (n,) and albedos (n,); NaN where nothing is hit.
Surface = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
BOARD_CORNERS = Size(4, 6)
BENT = np.array([-0.12, 0.05, 0.002, -0.003])


def rotation(x: float, y: float, z: float = 0.0) -> np.ndarray:
    """Turn by angles in degrees about x, then y, then z."""
    matrix = np.eye(3)
    for axis, angle in enumerate(np.radians([x, y, z])):
        turn, (a, b) = np.eye(3), [i for i in range(3) if i != axis]
        turn[a, a] = turn[b, b] = np.cos(angle)
        turn[a, b], turn[b, a] = -np.sin(angle), np.sin(angle)
        matrix = turn @ matrix
    return matrix


def rig_of(
    camera: Size, projector: Size, *, bent: np.ndarray | None = None, focal: float = 1.6
) -> StereoCalibration:
    """Set the projector to the left of the camera, turned towards what it sees."""

    def matrix(size: Size, up: float) -> list[list[float]]:
        f = focal * max(size)
        return [[f, 0, size.width / 2 - 0.5], [0, f, up * size.height - 0.5], [0, 0, 1]]

    turned = rotation(1.0, 17.0, 0.5)
    return StereoCalibration.from_opencv(
        camera, matrix(camera, 0.5), bent, projector, matrix(projector, 0.6), bent,
        turned, -turned @ [-0.2, 0.01, 0.0],
    )  # fmt: skip


def exact_pixels(stereo: StereoCalibration, surface: Surface) -> tuple[np.ndarray, np.ndarray]:
    """Points (Cy, Cx, 3) that the camera's pixels see in their middles, and their q."""
    rows, columns = np.indices(stereo.camera.size)
    rays = stereo.camera.rays(np.stack([columns.ravel(), rows.ravel()], axis=1).astype(float))
    points = rays * surface(rays)[0][:, None]
    q = stereo.projector.project(points @ stereo.rotation.T + stereo.translation)[0][:, ::-1]
    size = stereo.camera.size
    return points.reshape(*size, 3), q.reshape(*size, 2)


def transport_of(stereo: StereoCalibration, surface: Surface, samples: int = 3) -> ExactTransport:
    """Cast s x s rays through each camera pixel onto whole projector pixels."""
    (height, width), grid = stereo.camera.size, stereo.projector.size
    steps = (np.arange(samples) + 0.5) / samples - 0.5
    y, x = (np.add.outer(np.arange(side), steps).ravel() for side in (height, width))
    rows, columns = (v.ravel() for v in np.meshgrid(y, x, indexing="ij"))
    rays = stereo.camera.rays(np.stack([columns, rows], axis=1))
    depth, albedo = surface(rays)
    seen = np.isfinite(depth)
    points = (rays * depth[:, None])[seen]
    lit = stereo.projector.project(points @ stereo.rotation.T + stereo.translation)[0]
    lit = np.floor(lit + 0.5).astype(int)
    inside = ((lit >= 0) & (lit < [grid.width, grid.height])).all(axis=1)
    pixel = np.rint(rows[seen]).astype(int) * width + np.rint(columns[seen]).astype(int)
    entries = (
        (0.8 * albedo[seen] / samples**2)[inside],
        (pixel[inside], (lit[:, 1] * grid.width + lit[:, 0])[inside]),
    )
    direct = sparse.csr_array(entries, shape=(height * width, grid.pixels)).astype(np.float32)
    direct.sum_duplicates()
    none = sparse.csr_array(direct.shape, dtype=np.float32)
    far = np.zeros((1, *direct.shape), dtype=np.float32)
    return ExactTransport(grid, stereo.camera.size, (direct,), (none,), far)


def plane(point: np.ndarray, normal: np.ndarray) -> Surface:
    """A grey plane."""

    def hit(rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return (point @ normal) / (rays @ normal), np.full(len(rays), 0.7)

    return hit


def sphere(middle: np.ndarray, radius: float) -> Surface:
    """A grey ball."""

    def hit(rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        a, b = (rays**2).sum(axis=1), rays @ middle
        with np.errstate(invalid="ignore"):
            return (b - np.sqrt(b**2 - a * (middle @ middle - radius**2))) / a, np.full(len(a), 0.7)

    return hit


def board(
    turned: np.ndarray, middle: np.ndarray, corners: Size = BOARD_CORNERS, square: float = 0.03
) -> Surface:
    """A checkerboard about a place, with a white border."""

    def hit(rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        depth = (middle @ turned[:, 2]) / (rays @ turned[:, 2])
        x, y = ((rays * depth[:, None] - middle) @ turned[:, :2]).T / square
        x, y = x + (corners.width + 1) / 2, y + (corners.height + 1) / 2
        on = (x >= 0) & (x < corners.width + 1) & (y >= 0) & (y < corners.height + 1)
        dark = on & ((np.floor(x) + np.floor(y)) % 2 == 0)
        edge = 0.7
        inside = (x > -edge) & (x < corners.width + 1 + edge)
        inside &= (y > -edge) & (y < corners.height + 1 + edge)
        return np.where(inside, depth, np.nan), np.where(dark, 0.08, 0.9)

    return hit
