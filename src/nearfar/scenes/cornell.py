"""A box with a red and a green wall, a glazed cup and a translucent candle."""

from dataclasses import replace

import numpy as np

from nearfar.arrays import Size
from nearfar.scenes.description import ByRadiosity, SceneDescription
from nearfar.scenes.geometry import (
    Gloss,
    Material,
    Medium,
    Part,
    Scene,
    Vector,
    View,
    lathe,
    quadrilateral,
    ring,
    solid,
)

WHITE = Material((0.72, 0.72, 0.70))
RED = Material((0.60, 0.10, 0.08))
GREEN = Material((0.12, 0.50, 0.12))
CERAMIC = Material((0.50, 0.52, 0.56), gloss=Gloss(0.05, 30.0))
# In the range of published waxes and marbles, thinned so that the light spreads over a few
# projector pixels of 64 across the box.
WAX = Material(
    (0.14, 0.12, 0.10),
    gloss=Gloss(0.03, 20.0),
    medium=Medium((60.0, 70.0, 80.0), (2.5, 4.0, 10.0), 1.4),
)

PROJECTOR = View((0.0, 0.56, 2.3), (0.0, 0.5, 0.0), 0.207)
CAMERA = View((0.3, 0.62, 2.28), (-0.015, 0.5, -0.25), 0.204)
# Two projectors that light a part of the box each, and what both light is its middle.
LEFT_PROJECTOR = View((-0.3, 0.6, 2.3), (-0.17, 0.5, -0.3), 0.17)
RIGHT_PROJECTOR = View((0.3, 0.6, 2.3), (0.17, 0.5, -0.3), 0.17)


def _room() -> list[Part]:
    depth = 1.0
    back, across, upwards = (-0.5, 0.0, -depth), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    inwards, outwards = (0.0, 0.0, -depth), (0.0, 0.0, depth)
    return [
        quadrilateral("floor", (-0.5, 0.0, 0.0), across, inwards, WHITE),
        quadrilateral("ceiling", (-0.5, 1.0, -depth), across, outwards, WHITE),
        quadrilateral("back wall", back, across, upwards, WHITE),
        quadrilateral("left wall", (-0.5, 0.0, 0.0), inwards, upwards, RED),
        quadrilateral("right wall", (0.5, 0.0, -depth), outwards, upwards, GREEN),
    ]


def _cup(move: Vector) -> list[Part]:
    outside = [(0.085, 0.0), (0.105, 0.03), (0.118, 0.08), (0.125, 0.16), (0.128, 0.25)]
    rim = [(0.128, 0.25), (0.126, 0.254), (0.120, 0.256), (0.114, 0.254), (0.112, 0.25)]
    inside = [(0.112, 0.25), (0.109, 0.16), (0.100, 0.08), (0.088, 0.035), (0.0, 0.03)]
    handle = ring(0.075, 0.016)
    handle.apply_translation([0.125, 0.13, 0.0])
    return [
        solid("cup outside", lathe(outside), CERAMIC, move=move),
        solid("cup rim", lathe(rim), CERAMIC, move=move),
        solid("cup inside", lathe(inside), CERAMIC, move=move),
        solid("cup handle", handle, CERAMIC, move=move),
    ]


def _candle(move: Vector) -> list[Part]:
    height = np.linspace(0.0, 0.5, 11)
    side = np.stack([0.135 - 0.03 * height, height], axis=-1)
    top = [(0.12, 0.5), (0.117, 0.507), (0.108, 0.51), (0.05, 0.503), (0.0, 0.5)]
    return [
        solid("candle side", lathe(side), WAX, move=move),
        solid("candle top", lathe(top), WAX, move=move),
    ]


def cornell() -> Scene:
    """Describe the Cornell-like box, under a coaxial camera."""
    parts = _room() + _cup((0.2, 0.0, -0.33)) + _candle((-0.18, 0.0, -0.42))
    return Scene(name="cornell", parts=tuple(parts), projector_view=PROJECTOR, camera_view=None)


def cornell_aside() -> Scene:
    """Describe the same box; its finer camera stands on the right of the projector."""
    return replace(cornell(), name="cornell-aside", camera_view=CAMERA)


def cornell_left() -> Scene:
    """Describe the same box under a projector on the left; the camera is where cornell has it."""
    return replace(
        cornell(), name="cornell-left", projector_view=LEFT_PROJECTOR, camera_view=PROJECTOR
    )


def cornell_right() -> Scene:
    """Describe the same box under a projector on the right, and the same camera."""
    return replace(
        cornell(), name="cornell-right", projector_view=RIGHT_PROJECTOR, camera_view=PROJECTOR
    )


CORNELL = SceneDescription(
    summary="box of coloured walls, glazed cup, translucent candle",
    projector=Size(64, 64),
    compute=ByRadiosity(cornell),
)
CORNELL_ASIDE = SceneDescription(
    summary="the box of cornell, seen from the right",
    projector=Size(64, 64),
    camera_scale=2,
    compute=ByRadiosity(cornell_aside),
)
CORNELL_LEFT = SceneDescription(
    summary="the box of cornell, its left part lit by one of two projectors",
    projector=Size(64, 64),
    compute=ByRadiosity(cornell_left),
)
CORNELL_RIGHT = SceneDescription(
    summary="the same, its right part lit by the other one",
    projector=Size(64, 64),
    compute=ByRadiosity(cornell_right),
)
