"""The physical split on scenes that it was tuned on beside the built-in ones.

Run ``python benchmarks/trial_bodies.py [posts] [armchair] [steps] [steps-aside] [tree]``. Posts and
a ball of wax before a white wall are seen from aside by a camera no finer than the projector: their
outlines see two places. An armchair of spotted soap folds towards itself. Steps of striped soap in
a coloured corner light each other; a camera no finer than the projector sees them from aside, too.
A tree of striped wax has branches three projector pixels wide. For each it prints, from 117 photos
and in dB under white, how far direct light, light under surfaces and inter-reflection of the
physical split are from those of the scene, and the share of errors within one standard deviation at
translucent surfaces. A scene takes one to three minutes to compute, and is not kept.
"""

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from accuracy import shoot
from components import line, within
from fewer_photos import jointly
from nearfar import PhysicalErrorBars, Size, choose_plan, split_physically
from nearfar.arrays import Floats
from nearfar.rigs.simulated.camera import SimulatedCamera
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
    sheet,
    solid,
)
from nearfar.scenes.implicit import Bone, grown_together, zero_surface
from nearfar.scenes.render import render
from nearfar.workflow.physical_split import physical_snr

SIZE = Size(64, 64)
PHOTOS, WINDOW = 117, 11
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


SCENES: dict[str, Callable[[], Scene]] = {
    "posts": posts,
    "armchair": armchair,
    "steps": steps,
    "steps-aside": lambda: steps(FROM_ASIDE),
    "tree": tree,
}


def run(name: str) -> None:
    """Measure one scene."""
    scene = render(SCENES[name](), SIZE, SIZE, progress=lambda _, __: None)
    plan, _ = choose_plan(scene.projector, PHOTOS, window=WINDOW)
    transport = jointly(plan, shoot(plan, scene, SimulatedCamera()))
    split = split_physically(transport)
    white = np.ones(scene.projector, dtype=np.float32)
    truth, found = scene.component_pictures(white), split.components(white)
    names = found._fields
    bars = PhysicalErrorBars(split).components(white)
    translucent = truth[1].any(axis=-1) & transport.lit
    print(f"{name}: {line(physical_snr(split, scene).components, names)}")
    print(f"  within error bars {within(found, truth, bars, translucent)}", flush=True)


if __name__ == "__main__":
    for scene_name in sys.argv[1:] or SCENES:
        run(scene_name)
