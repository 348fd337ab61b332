"""The corner of a room: two walls and a wooden floor, seen along the diagonal."""

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.scenes.description import ByRadiosity, SceneDescription
from nearfar.scenes.geometry import Material, Scene, View, quadrilateral


def _planks(position: Floats) -> Floats:
    """Boards of 11 cm, each of its own tone."""
    board = np.floor(position[..., 0] / 0.11)
    return np.asarray(1 + 0.16 * np.sin(12.9898 * board + 1.0))


WALL_LENGTH = 1.35
CREAM = Material((0.74, 0.71, 0.62))
SKY = Material((0.58, 0.66, 0.74))
WOOD = Material((0.68, 0.42, 0.22), texture=_planks)
VIEW = View((1.75, 1.78, 1.75), (0.02, 0.05, 0.02), 0.175)


def corner(length: float = WALL_LENGTH, view: View = VIEW) -> Scene:
    """Describe the corner, under a coaxial camera: of walls that reach beyond its view, or not."""
    x, y, z = (length, 0.0, 0.0), (0.0, length, 0.0), (0.0, 0.0, length)
    origin = (0.0, 0.0, 0.0)
    return Scene(
        name="corner",
        parts=(
            quadrilateral("floor", origin, z, x, WOOD),
            quadrilateral("left wall", origin, y, z, CREAM),
            quadrilateral("right wall", origin, x, y, SKY),
        ),
        projector_view=view,
        camera_view=None,
    )


CORNER = SceneDescription(
    summary="three walls",
    projector=Size(128, 128),
    compute=ByRadiosity(corner),
)
