"""A toy bear in a wedge: two planes that meet in a concave ridge."""

from typing import Any

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.scenes.description import ByRadiosity, SceneDescription
from nearfar.scenes.geometry import (
    Material,
    Part,
    Scene,
    Vector,
    View,
    ball,
    quadrilateral,
    ring,
    rotation,
    solid,
    tube,
)


def _checks(position: Floats) -> Floats:
    """Two tones in squares of 16 cm."""
    squares = np.floor(position[..., 0] / 0.16 + 0.5) + np.floor(position[..., 2] / 0.16 + 0.25)
    return np.asarray(1 + 0.18 * (2 * (squares % 2) - 1))


GROUND = Material((0.66, 0.58, 0.45), texture=_checks)
SLOPE = Material((0.52, 0.61, 0.70))
FUR = Material((0.56, 0.36, 0.20))
SNOUT = Material((0.64, 0.54, 0.40))
BLACK = Material((0.05, 0.05, 0.05))
SCARF = Material((0.65, 0.12, 0.10))
# The slope leans back from the upright.
SLOPE_ANGLE = np.radians(14)
VIEW = View((0.0, 1.77, 2.11), (0.0, 0.1, 0.12), 0.24)


def _bear(move: Vector, turn: float) -> list[Part]:
    """Make a sitting bear, 35 cm tall, turned about the y axis (radians)."""
    lying = ring(0.062, 0.022)
    lying.apply_transform(np.eye(4)[[0, 2, 1, 3]] * [1, 1, -1, 1])
    pieces: list[tuple[str, Any, Vector, Material]] = [
        ("body", ball((0.095, 0.115, 0.085)), (0.0, 0.11, 0.0), FUR),
        ("head", ball(0.082), (0.0, 0.265, 0.015), FUR),
        ("scarf", lying, (0.0, 0.195, 0.01), SCARF),
        ("snout", ball((0.038, 0.03, 0.032)), (0.0, 0.245, 0.088), SNOUT),
        ("nose", ball(0.013, subdivisions=3), (0.0, 0.258, 0.118), BLACK),
    ]
    for side, name in ((-1, "left"), (1, "right")):
        pieces += [
            (f"{name} ear", ball((0.032, 0.032, 0.018)), (side * 0.062, 0.335, 0.005), FUR),
            (f"{name} eye", ball(0.012, subdivisions=3), (side * 0.032, 0.288, 0.087), BLACK),
            (
                f"{name} leg",
                tube((side * 0.05, 0.038, 0.05), (side * 0.085, 0.038, 0.155), 0.037),
                (0.0, 0.0, 0.0),
                FUR,
            ),
            (
                f"{name} arm",
                tube((side * 0.08, 0.165, 0.02), (side * 0.125, 0.095, 0.085), 0.027),
                (0.0, 0.0, 0.0),
                FUR,
            ),
        ]
    about = rotation(turn, (0.0, 1.0, 0.0))
    parts = []
    for name, mesh, place, material in pieces:
        mesh.apply_translation(place)
        mesh.apply_transform(about)
        parts.append(solid(name, mesh, material, move=move))
    return parts


def wedge() -> Scene:
    """Describe the wedge with the bear, under a coaxial camera."""
    up = (0.0, 0.65 * float(np.cos(SLOPE_ANGLE)), -0.65 * float(np.sin(SLOPE_ANGLE)))
    planes = [
        quadrilateral("ground", (-0.75, 0.0, 0.8), (1.5, 0.0, 0.0), (0.0, 0.0, -0.8), GROUND),
        quadrilateral("slope", (-0.75, 0.0, 0.0), (1.5, 0.0, 0.0), up, SLOPE),
    ]
    return Scene(
        name="wedge",
        parts=(*planes, *_bear((-0.05, 0.001, 0.17), 0.35)),
        projector_view=VIEW,
        camera_view=None,
    )


WEDGE = SceneDescription(
    summary="toy bear where two planes meet",
    projector=Size(68, 100),
    compute=ByRadiosity(wedge),
)
