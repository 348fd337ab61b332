"""Scenes on which the physical split was tuned.

Posts and a ball of wax before a white wall are seen from aside by a camera no finer than the
projector: their outlines see two places. An armchair of spotted soap folds towards itself. Steps of
striped soap in a coloured corner light each other; a camera no finer than the projector sees them
from aside, too. A tree of striped wax has branches three projector pixels wide. A bar of soap and a
ball, and a cat of wax, stand on an opaque floor that they light.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from nearfar.arrays import Floats
from nearfar.scenes.geometry import (
    Gloss,
    Material,
    Medium,
    Part,
    Scene,
    View,
    ball,
    lathe,
    quadrilateral,
    rotation,
    sheet,
    solid,
)
from nearfar.scenes.implicit import Bone, grown_together, zero_surface

WHITE, BLUE = Material((0.6, 0.6, 0.58)), Material((0.15, 0.3, 0.6))
WAX = Material(
    (0.14, 0.12, 0.10),
    gloss=Gloss(0.03, 20.0),
    medium=Medium((60.0, 70.0, 80.0), (1.5, 3.0, 7.0), 1.4),
)


def _spots(position: Floats) -> Floats:
    x, y, z = np.moveaxis(position, -1, 0)
    return np.asarray(1 - 0.35 * ((np.sin(40 * x) * np.sin(37 * y + 5 * z)) > 0.35))


SOAP = Material(
    (0.15, 0.13, 0.14),
    gloss=Gloss(0.02, 30.0),
    medium=Medium((50.0, 60.0, 70.0), (1.0, 1.4, 2.5), 1.45),
    texture=_spots,
)
# Height and distance of the armchair's outline, from its front upwards, and half of its width.
OUTLINE = np.array(
    [
        (0.0, 0.60),
        (0.16, 0.55),
        (0.16, 0.40),
        (0.06, 0.32),
        (0.06, 0.16),
        (0.10, 0.10),
        (0.30, 0.0),
        (0.48, -0.16),
        (0.55, -0.25),
    ]
)
HALF_WIDTH = 0.32
# Place, radius and height of posts.
POSTS = ((-0.28, 0.05, 0.6), (-0.12, 0.055, 0.72), (0.05, 0.05, 0.66))


def _floor() -> Part:
    return quadrilateral("floor", (-0.8, 0.0, -0.6), (0.0, 0.0, 1.6), (1.6, 0.0, 0.0), WHITE)


def _wall(away: float, material: Material) -> Part:
    return quadrilateral("wall", (-0.8, 0.0, away), (1.6, 0.0, 0.0), (0.0, 1.2, 0.0), material)


def armchair() -> Scene:
    """Describe the armchair, under a coaxial camera."""
    height, away = OUTLINE.T

    def at(x: float, y: Floats) -> Floats:
        return np.stack([np.full_like(y, x), y, away], axis=-1)

    right, left = at(HALF_WIDTH, height), at(-HALF_WIDTH, height)
    parts = (
        solid("seat", sheet([right, left]), SOAP),
        solid("right cheek", sheet([at(HALF_WIDTH, 0 * height), right]), SOAP),
        solid("left cheek", sheet([left, at(-HALF_WIDTH, 0 * height)]), SOAP),
    )
    view = View((-0.5, 1.15, 2.3), (0.02, 0.27, 0.1), 0.2)
    return Scene("armchair", (_floor(), _wall(-0.6, BLUE), *parts), view, None)


def posts() -> Scene:
    """Describe posts and a ball, seen from aside."""
    turn = np.linspace(0, np.pi / 2, 8)[1:]
    parts = []
    for x, radius, height in POSTS:
        side = np.stack([np.full(10, radius), np.linspace(0, height, 10)], axis=-1)
        cap = np.stack([radius * np.cos(turn), height + radius * np.sin(turn)], axis=-1)
        cap[-1, 0] = 0.0
        parts.append(solid("post", lathe(np.concatenate([side, cap])), WAX, move=(x, 0.0, 0.1)))
    parts.append(solid("ball", ball(0.12), WAX, move=(0.26, 0.12, 0.25)))
    views = (View(place, (0.0, 0.38, 0.0), 0.2) for place in ((-0.5, 0.6, 2.3), (0.1, 0.7, 2.35)))
    return Scene("posts", (_floor(), _wall(-0.35, WHITE), *parts), *views)


def _stripes(position: Floats) -> Floats:
    x, y, z = np.moveaxis(position, -1, 0)
    across = np.sin(23 * x + 3 * y) * np.sin(19 * y + 8 * z)
    return np.asarray(1 - 0.5 * np.exp(-((across / 0.3) ** 2)))


STRIPED_SOAP = Material(
    (0.2, 0.17, 0.12),
    gloss=Gloss(0.03, 35.0),
    medium=Medium((66.0, 70.0, 75.0), (1.1, 1.6, 3.0), 1.4),
    texture=_stripes,
)
NAVY, ORANGE = Material((0.15, 0.22, 0.6)), Material((0.75, 0.42, 0.12))
GREY = Material((0.42, 0.42, 0.4))
# Steps: how many, how high and how deep, and how wide the flight.
STEPS, RISE, RUN, WIDTH = 3, 0.16, 0.21, 0.6
# Distance from an edge at which a step's outline has another point, and rounding of outer edges.
NEXT_TO_EDGES, ROUNDING = 0.004, 0.02
FROM_THE_PROJECTOR = View((1.5, 1.6, 2.3), (0.42, 0.24, 0.25), 0.2)
FROM_ASIDE = View((0.9, 1.55, 2.6), (0.42, 0.24, 0.25), 0.18)


def _steps_outline() -> Floats:
    """Return height and distance from the back wall, from the foot of the flight upwards."""
    turn = np.linspace(0, np.pi / 2, 7)[1:-1]
    rounded = ROUNDING * np.stack([np.sin(turn) - 1, np.cos(turn) - 1], axis=-1)
    points: list[Floats] = []
    for number in range(STEPS):
        foot, top, front = RISE * number, RISE * (number + 1), (STEPS - number) * RUN
        back = front - RUN
        riser = [foot, foot + NEXT_TO_EDGES, top - ROUNDING - NEXT_TO_EDGES, top - ROUNDING]
        tread = [front - ROUNDING, front - ROUNDING - NEXT_TO_EDGES, back + NEXT_TO_EDGES, back]
        points.append(np.stack([riser, np.full(4, front)], axis=-1))
        points.append(rounded + np.array([top, front]))
        points.append(np.stack([np.full(4, top), tread], axis=-1))
    return np.concatenate(points)


def steps(camera: View | None = None) -> Scene:
    """Describe steps in a corner, under a coaxial camera or another."""
    height, away = _steps_outline().T

    def at(x: float, y: Floats) -> Floats:
        return np.stack([np.full_like(y, x), y, away], axis=-1)

    origin, x, y, z = (0.0, 0.0, 0.0), (1.6, 0.0, 0.0), (0.0, 1.4, 0.0), (0.0, 0.0, 1.6)
    parts = (
        quadrilateral("floor", origin, z, x, GREY),
        quadrilateral("left wall", origin, y, z, NAVY),
        quadrilateral("back wall", origin, x, y, ORANGE),
        solid("steps", sheet([at(WIDTH, height), at(0.0, height)]), STRIPED_SOAP),
        solid("cheek", sheet([at(WIDTH, 0 * height), at(WIDTH, height)]), STRIPED_SOAP),
    )
    return Scene("steps", parts, FROM_THE_PROJECTOR, camera)


def _rings(position: Floats) -> Floats:
    x, y, _ = np.moveaxis(position, -1, 0)
    return np.asarray(1 - 0.45 * np.exp(-((np.sin(31 * y + 9 * x) / 0.35) ** 2)))


BARK = Material(
    (0.14, 0.12, 0.10),
    gloss=Gloss(0.04, 30.0),
    medium=Medium((75.0, 82.0, 90.0), (1.3, 3.5, 7.0), 1.4),
    texture=_rings,
)
ROSE, SLATE, GREEN = (
    Material(albedo) for albedo in ((0.45, 0.3, 0.3), (0.3, 0.35, 0.5), (0.2, 0.6, 0.3))
)
# The tree is drawn in units of 2.9 mm.
TREE_UNIT = 0.0029
BRANCHES = (
    Bone((0, -80, 0), (0, 20, 0), (22.0, 18.0)),
    Bone((0, 20, 0), (-50, 90, 10), (14.0, 9.0)),
    Bone((-50, 90, 10), (-55, 150, 20), (9.0, 8.0)),
    Bone((0, 20, 0), (10, 110, 5), (14.0, 10.0)),
    Bone((10, 110, 5), (5, 170, 15), (10.0, 8.5)),
    Bone((0, 20, 0), (55, 80, 15), (13.0, 9.0)),
    Bone((55, 80, 15), (65, 140, 15), (9.0, 8.0)),
    Bone((0, -30, 5), (45, -10, 20), (12.0, 9.0)),
    Bone((45, -10, 20), (70, 30, 25), (9.0, 9.0)),
)


def tree() -> Scene:
    """Describe the tree before a wall, its camera to the left of its projector."""
    low, high = (-95.0, -112.0, -36.0), (95.0, 195.0, 60.0)
    mesh = zero_surface(grown_together(BRANCHES, 3.0), low, high, 1.8)
    mesh.apply_scale(TREE_UNIT)
    left, back, front = -0.75, -0.38, 0.55
    across, inwards, up = (1.5, 0.0, 0.0), (0.0, 0.0, back - front), (0.0, 1.0, 0.0)
    screen = quadrilateral("screen", (-0.4, 0.0, back), (-0.1, 0.0, front - back), up, GREEN)
    parts = (
        quadrilateral("table", (left, 0.0, front), across, inwards, SLATE),
        quadrilateral("wall", (left, 0.0, back), across, up, ROSE),
        replace(screen, occludes=True),
        solid("tree", mesh, BARK, move=(0.02, 0.235, 0.0)),
    )
    projector = View((0.35, 0.7, 2.3), (0.0, 0.42, -0.1), 0.19)
    return Scene("tree", parts, projector, View((-0.25, 0.6, 2.35), (0.0, 0.42, -0.08), 0.166))


def _chequers(position: Floats) -> Floats:
    x, _, z = np.moveaxis(np.floor((position + 0.013) / 0.11), -1, 0)
    return np.where((x + z) % 2 == 0, 0.35, 1.65)


def _stamp(position: Floats) -> Floats:
    x, y, z = np.moveaxis(position, -1, 0)
    radius = np.hypot((x + 0.2) / 0.13, (y + z - 0.22) / 0.09)
    return np.where(np.abs(radius - 0.75) < 0.14, 0.55, 1.0)


PLAIN_SOAP = Material(
    (0.12, 0.13, 0.11),
    gloss=Gloss(0.04, 30.0),
    medium=Medium((65.0, 75.0, 85.0), (2.0, 4.5, 9.0), 1.4),
)
# Half of the bar of soap's sides, and rounding of its edges.
BAR, BAR_ROUNDING = (0.19, 0.065, 0.12), 0.035


def _to_bar(position: Floats) -> Floats:
    """Return the distance from the bar's surface."""
    beyond = np.abs(position) - (np.array(BAR) - BAR_ROUNDING)
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=-1)
    return np.asarray(outside + np.minimum(beyond.max(axis=-1), 0.0) - BAR_ROUNDING)


def soap() -> Scene:
    """Describe a bar of soap and a ball on a chequered table, under a coaxial camera."""
    bar = zero_surface(_to_bar, (-0.23, -0.1, -0.16), (0.23, 0.1, 0.16), 0.006)
    bar.apply_transform(rotation(0.35, (0.0, 1.0, 0.0)))
    across, inwards, up = (1.9, 0.0, 0.0), (0.0, 0.0, -1.3), (0.0, 1.2, 0.0)
    table = Material((0.45, 0.42, 0.40), texture=_chequers)
    stamped = replace(PLAIN_SOAP, texture=_stamp)
    parts = (
        quadrilateral("table", (-0.95, 0.0, 0.9), across, inwards, table),
        quadrilateral("wall", (-0.95, 0.0, -0.4), across, up, Material((0.75, 0.40, 0.12))),
        solid("soap", bar, stamped, move=(-0.19, 0.066, 0.12)),
        solid("ball", ball(0.15), PLAIN_SOAP, move=(0.2, 0.151, -0.08)),
    )
    return Scene("soap", parts, View((-0.1, 0.95, 2.15), (0.0, 0.16, 0.0), 0.19), None)


CAT = (
    Bone((0, 0.06, 0), (0, 0.26, -0.02), (0.125, 0.085)),
    Bone((0, 0.26, -0.02), (0, 0.40, 0.01), (0.06, 0.06)),
    Bone((0, 0.42, 0.01), (0, 0.43, 0.05), (0.085, 0.07)),
    Bone((-0.05, 0.47, 0), (-0.085, 0.555, -0.01), (0.03, 0.012)),
    Bone((0.05, 0.47, 0), (0.085, 0.555, -0.01), (0.03, 0.012)),
    Bone((-0.06, 0.27, 0.03), (-0.085, 0.03, 0.13), (0.042, 0.035)),
    Bone((0.06, 0.27, 0.03), (0.085, 0.03, 0.13), (0.042, 0.035)),
    Bone((0.10, 0.05, -0.05), (0.24, 0.07, 0.02), (0.04, 0.03)),
    Bone((0.24, 0.07, 0.02), (0.27, 0.22, 0), (0.03, 0.022)),
)


def _coat(position: Floats) -> Floats:
    x, y, z = np.moveaxis(position, -1, 0)
    stripes = np.sin(2 * np.pi * (y + 0.03 * np.sin(14 * x + 9 * z)) / 0.062)
    spots = np.sin(38 * x + 1) * np.sin(33 * y) > 0.55
    return np.where(spots, 1.35, np.where(stripes > 0.45, 0.3, 1.0))


def _bricks(position: Floats) -> Floats:
    along, up, _ = np.moveaxis(position, -1, 0)
    row = np.floor(up / 0.09)
    brick = (along + 0.09 * (row % 2)) / 0.18
    mortar = (np.abs(brick - np.rint(brick)) < 0.05) | (
        np.abs(up / 0.09 - np.rint(up / 0.09)) < 0.08
    )
    return np.where(mortar, 1.5, 0.8 + 0.15 * np.sin(5 * row + 9 * np.floor(brick)))


FUR = Material(
    (0.2, 0.16, 0.12),
    gloss=Gloss(0.03, 25.0),
    medium=Medium((70.0, 70.0, 80.0), (1.5, 3.0, 7.0), 1.4),
    texture=_coat,
)


def cat() -> Scene:
    """Describe a striped cat of wax before bricks, seen from aside."""
    mesh = zero_surface(grown_together(CAT, 0.012), (-0.19, -0.09, -0.19), (0.33, 0.6, 0.21), 0.007)
    floor = Material((0.60, 0.56, 0.48), texture=lambda at: 1 + 0.25 * np.sin(60 * at[..., 0]))
    bricks = Material((0.40, 0.18, 0.14), texture=_bricks)
    across, inwards, up = (1.8, 0.0, 0.0), (0.0, 0.0, -1.1), (0.0, 1.1, 0.0)
    screen = quadrilateral("screen", (-0.42, 0, 0.25), (0, 0, -0.55), (0, 0.5, 0), NAVY)
    parts = (
        quadrilateral("floor", (-0.9, 0.0, 0.8), across, inwards, floor),
        quadrilateral("wall", (-0.9, 0.0, -0.3), across, up, bricks),
        replace(screen, occludes=True),
        solid("cat", mesh, FUR, move=(-0.01, 0.072, 0.0)),
    )
    projector = View((0.35, 0.60, 2.25), (-0.02, 0.30, 0.0), 0.185)
    return Scene("cat", parts, projector, View((-0.25, 0.75, 2.25), (-0.01, 0.30, 0.0), 0.18))


SCENES: dict[str, Callable[[], Scene]] = {
    "posts": posts,
    "armchair": armchair,
    "steps": steps,
    "steps-aside": lambda: steps(FROM_ASIDE),
    "tree": tree,
    "soap": soap,
    "cat": cat,
}
