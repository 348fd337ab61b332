"""Steps of veined marble in the corner between a green and a red wall, and a glazed ball."""

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.scenes.description import ByRadiosity, SceneDescription
from nearfar.scenes.geometry import (
    Gloss,
    Material,
    Medium,
    Part,
    Scene,
    View,
    ball,
    quadrilateral,
    sheet,
    solid,
)

# Steps: how many, how high and how deep, how wide the flight, and the rounding of edges, in metres.
STEPS, RISE, RUN, WIDTH, ROUNDING = 4, 0.125, 0.165, 0.44, 0.018
# Distances from the ends of a straight line at which the outline has more points.
NEXT_TO_EDGES = 0.004


def _veins(position: Floats) -> Floats:
    """Grey veins, thick ones and thin ones, that run through the stone."""
    x, y, z = np.moveaxis(position, -1, 0)
    warp = 0.05 * np.sin(9 * y + 6 * x) + 0.03 * np.sin(17 * z - 11 * x + 2) + 0.02 * np.sin(29 * x)
    thick = np.sin(np.pi * (0.9 * x + 0.5 * y - 0.7 * z + 1.6 * warp) / 0.19)
    thin = np.sin(np.pi * (0.6 * x - 0.8 * y + 0.6 * z - 1.2 * warp) / 0.083 + 0.7)
    return np.asarray(
        1.12 - 0.55 * np.exp(-((thick / 0.22) ** 2)) - 0.28 * np.exp(-((thin / 0.18) ** 2))
    )


def _tiles(position: Floats) -> Floats:
    """Two tones in squares of 16 cm."""
    squares = np.floor(position[..., 0] / 0.16 + 0.3) + np.floor(position[..., 2] / 0.16 + 0.3)
    return np.asarray(1 + 0.3 * (2 * (squares % 2) - 1))


GREEN = Material((0.10, 0.46, 0.24))
RED = Material((0.70, 0.22, 0.12))
SLATE = Material((0.30, 0.31, 0.34), texture=_tiles)
GLAZE = Material((0.62, 0.42, 0.06), gloss=Gloss(0.06, 60.0))
# Marble as measured by Jensen et al. (2001), thinned and darkened so that light spreads over
# three (blue) to five (red) projector pixels of 64 across the corner.
MARBLE = Material(
    (0.16, 0.16, 0.16),
    gloss=Gloss(0.02, 30.0),
    medium=Medium((58.0, 62.0, 68.0), (0.9, 1.0, 1.5), 1.5),
    texture=_veins,
)

VIEW = View((1.75, 1.42, 2.2), (0.37, 0.25, 0.27), 0.2)


def _outline() -> Floats:
    """Return height and distance from the back wall, from the foot of the flight upwards."""
    corners = []
    for number in range(STEPS):
        front = (STEPS - number) * RUN
        corners += [(RISE * number, front), (RISE * (number + 1), front)]
    corners.append((RISE * STEPS, 0.0))
    turn = np.linspace(0, np.pi / 2, 7)[:, None]
    points: list[Floats] = []
    for start, end, outer in zip(corners[:-1], corners[1:], [True, False] * STEPS, strict=True):
        # A riser ends where its edge is rounded, and a tread begins there.
        first, last = np.array(start), np.array(end)
        way = (last - first) / np.linalg.norm(last - first)
        first = first if outer else first + ROUNDING * way
        last = last - ROUNDING * way if outer else last
        inner = np.array([first, first + NEXT_TO_EDGES * way, last - NEXT_TO_EDGES * way, last])
        points.append(inner)
        if outer:
            middle = last - (0.0, ROUNDING)
            points.append(middle + ROUNDING * np.hstack([np.sin(turn), np.cos(turn)])[1:-1])
    return np.concatenate(points)


def _flight() -> list[Part]:
    height, away = _outline().T

    def at(x: float, y: Floats) -> Floats:
        return np.stack([np.full_like(y, x), y, away], axis=-1)

    return [
        solid("steps", sheet([at(WIDTH, height), at(0.0, height)]), MARBLE),
        solid("cheek", sheet([at(WIDTH, 0 * height), at(WIDTH, height)]), MARBLE),
    ]


def marble() -> Scene:
    """Describe the steps, under a coaxial camera."""
    x, y, z = (1.6, 0.0, 0.0), (0.0, 1.4, 0.0), (0.0, 0.0, 1.6)
    origin = (0.0, 0.0, 0.0)
    return Scene(
        name="marble",
        parts=(
            quadrilateral("floor", origin, z, x, SLATE),
            quadrilateral("left wall", origin, y, z, GREEN),
            quadrilateral("back wall", origin, x, y, RED),
            *_flight(),
            solid("ball", ball(0.085), GLAZE, move=(0.70, 0.085, 0.44)),
        ),
        projector_view=VIEW,
        camera_view=None,
    )


MARBLE_STEPS = SceneDescription(
    summary="steps of veined marble between coloured walls",
    projector=Size(64, 64),
    compute=ByRadiosity(marble),
    held_out=True,
)
