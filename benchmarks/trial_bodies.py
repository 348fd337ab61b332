"""The physical split on scenes that it was tuned on beside the built-in ones.

Run ``python benchmarks/trial_bodies.py [posts] [armchair]``. Posts and a ball of wax before a white
wall are seen from aside by a camera no finer than the projector: their outlines see two places.
An armchair of spotted soap folds towards itself. For each it prints, from 117 photos and in dB
under white, how far direct light, light under surfaces and inter-reflection of the physical split
are from those of the scene, and the share of errors within one standard deviation at translucent
surfaces. A scene takes one to three minutes to compute, and is not kept.
"""

import sys
from collections.abc import Callable

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


SCENES: dict[str, Callable[[], Scene]] = {"posts": posts, "armchair": armchair}


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
