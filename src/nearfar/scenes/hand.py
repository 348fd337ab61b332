"""A hand of wax on a plinth, its palm towards the projector, seen from aside."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from nearfar.arrays import Floats, Size
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
    solid,
)
from nearfar.scenes.implicit import Bone, grown_together, zero_surface

# The hand is drawn in millimetres about the middle of the wrist, x to the thumb's side, y along the
# middle finger, z out of the palm; and stands so many metres tall for each.
SCALE = 0.0029
WRIST: Vector = (-0.06, 0.165, -0.02)
# Fingers from little to index: first joint, degrees they are spread, lengths and radii of bones.
FINGERS: tuple[tuple[Vector, float, Vector, Vector], ...] = (
    ((-35.0, 78.0, 3.0), -17.0, (38.0, 22.0, 19.0), (9.0, 8.2, 7.6)),
    ((-14.5, 89.0, 2.0), -6.0, (46.0, 28.0, 22.0), (10.0, 9.2, 8.4)),
    ((6.0, 93.0, 1.0), 2.0, (50.0, 31.0, 23.0), (10.4, 9.6, 8.7)),
    ((27.0, 88.0, 2.0), 11.0, (45.0, 27.0, 21.0), (10.2, 9.3, 8.5)),
)
# Degrees by which each bone of a finger leans out of the palm, from index to little finger alike.
CURL = (6.0, 16.0, 26.0)
TAPER = 0.92
THUMB = (
    Bone((18.0, 12.0, 8.0), (44.0, 46.0, 16.0), (17.0, 13.5)),
    Bone((44.0, 46.0, 16.0), (64.0, 76.0, 22.0), (12.0, 10.5)),
    Bone((64.0, 76.0, 22.0), (74.0, 102.0, 25.0), (10.5, 8.0)),
)
FOREARM = (
    Bone((-11.0, -46.0, -1.0), (-12.0, 6.0, 0.0), (17.0, 15.0)),
    Bone((11.0, -46.0, -1.0), (12.0, 6.0, 0.0), (17.0, 15.0)),
)
# Length over which bones grow together, millimetres, and edge of the cells that the skin is cut to.
BLEND = 2.4
CELL = 1.8

# Lines through three points each (x, y): the middle one draws the line towards itself.
PALM_LINES = (
    ((-42.0, 66.0), (-6.0, 62.0), (16.0, 84.0)),
    ((33.0, 64.0), (4.0, 62.0), (-32.0, 40.0)),
    ((34.0, 67.0), (2.0, 50.0), (7.0, 6.0)),
    ((-22.0, 1.0), (0.0, -4.0), (22.0, 2.0)),
)
VEINS = (
    ((-16.0, -60.0), (-14.0, -20.0), (-4.0, 14.0)),
    ((9.0, -60.0), (2.0, -25.0), (-10.0, -4.0)),
    ((-4.0, 14.0), (-18.0, 34.0), (-30.0, 66.0)),
    ((-4.0, 14.0), (6.0, 40.0), (-8.0, 74.0)),
)
# How dark they are at the middle, and their half width in millimetres.
CREASE, VEIN = (0.5, 1.8), (0.35, 3.0)
STEPS_ALONG = 9


def _finger(joint: Vector, spread: float, lengths: Vector, radii: Vector) -> list[Bone]:
    """Return the three bones of a finger."""
    turn = np.radians(spread)
    bones, start = [], np.array(joint)
    for length, radius, curl in zip(lengths, radii, np.radians(CURL), strict=True):
        flat = np.cos(curl)
        end = start + length * np.array([np.sin(turn) * flat, np.cos(turn) * flat, np.sin(curl)])
        bones.append(Bone(_vector(start), _vector(end), (radius, TAPER * radius)))
        start = end
    return bones


def _vector(values: Floats) -> Vector:
    x, y, z = values.tolist()
    return x, y, z


def _curve(first: Floats, middle: Floats, last: Floats) -> Floats:
    """Return points (STEPS_ALONG, 2) on the parabola that three points pull."""
    t = np.linspace(0, 1, STEPS_ALONG)[:, None]
    return np.asarray((1 - t) ** 2 * first + 2 * t * (1 - t) * middle + t**2 * last)


def _creases() -> list[Floats]:
    """Return lines of the palm, and two across each finger at every joint."""
    lines = [_curve(*np.array(points)) for points in PALM_LINES]
    for joint, spread, lengths, radii in FINGERS:
        across = np.array([np.cos(np.radians(spread)), -np.sin(np.radians(spread))])
        bones = _finger(joint, spread, lengths, radii)
        root = np.add(bones[0].start, 0.42 * np.subtract(bones[0].end, bones[0].start))
        places = np.stack([root, bones[1].start, bones[2].start])[:, None, :2]
        lines.extend(places + radii[0] * np.outer((-1.0, 1.0), across))
    return lines


def _shade(place: Floats, lines: list[Floats], depth: float, width: float) -> Floats:
    """Return a factor (...) that is less about lines (n, 2), at places (..., 2)."""
    nearest = np.full(place.shape[:-1], np.inf)
    for line in lines:
        for start, end in pairwise(line):
            way = end - start
            along = np.clip((place - start) @ way / (way @ way), 0, 1)
            off = place - start - along[..., None] * way
            np.minimum(nearest, np.einsum("...x,...x->...", off, off), out=nearest)
    return np.asarray(1 - depth * np.exp(-nearest / width**2))


def _skin(position: Floats) -> Floats:
    """Draw creases and veins on the hand."""
    place = ((position - WRIST) / SCALE)[..., :2]
    veins = [_curve(*np.array(points)) for points in VEINS]
    return _shade(place, _creases(), *CREASE) * _shade(place, veins, *VEIN)


def _planks(position: Floats) -> Floats:
    """Boards of 13 cm, each of its own tone."""
    board = np.floor(position[..., 2] / 0.13)
    return np.asarray(1 + 0.15 * np.sin(7.3 * board))


WALL = Material((0.22, 0.40, 0.46))
SCREEN = Material((0.72, 0.50, 0.12))
WOOD = Material((0.56, 0.38, 0.24), texture=_planks)
EBONY = Material((0.08, 0.06, 0.06), gloss=Gloss(0.05, 40.0))
# Between wax and the skin of Jensen et al. (2001): red light spreads far, blue little; thinned.
WAX = Material(
    (0.15, 0.11, 0.10),
    gloss=Gloss(0.03, 25.0),
    medium=Medium((70.0, 80.0, 90.0), (1.6, 5.0, 8.0), 1.4),
    texture=_skin,
)

PROJECTOR = View((-0.4, 0.66, 2.35), (0.02, 0.40, -0.1), 0.19)
CAMERA = View((0.24, 0.56, 2.4), (0.035, 0.405, -0.08), 0.166)


def _hand() -> Part:
    fingers = [_finger(*finger) for finger in FINGERS]
    wrist = np.linspace((-14.0, 8.0, 0.0), (14.0, 8.0, 0.0), len(fingers))
    palm = [
        Bone(_vector(start), bones[0].start, (13.0, 1.1 * bones[0].radii[0]))
        for start, bones in zip(wrist, fingers, strict=True)
    ]
    bones = [*palm, *(bone for finger in fingers for bone in finger), *THUMB, *FOREARM]
    low, high = (-85.0, -68.0, -24.0), (92.0, 212.0, 64.0)
    mesh = zero_surface(grown_together(bones, BLEND), low, high, CELL)
    mesh.apply_scale(SCALE)
    return solid("hand", mesh, WAX, move=WRIST)


def hand() -> Scene:
    """Describe the hand; its projector stands on the left, its camera on the right."""
    plinth = [(0.15, 0.0), (0.15, 0.03), (0.135, 0.045), (0.12, 0.05), (0.0, 0.05)]
    left, right, back, front = -0.75, 0.75, -0.38, 0.55
    across, inwards, up = (right - left, 0.0, 0.0), (0.0, 0.0, back - front), (0.0, 1.0, 0.0)
    screen = quadrilateral("screen", (0.33, 0.0, back), (0.42, 0.0, front - back), up, SCREEN)
    x, _, z = WRIST
    return Scene(
        name="hand",
        parts=(
            quadrilateral("table", (left, 0.0, front), across, inwards, WOOD),
            quadrilateral("wall", (left, 0.0, back), across, up, WALL),
            replace(screen, occludes=True),
            solid("plinth", lathe(plinth), EBONY, move=(x, 0.0, z)),
            _hand(),
        ),
        projector_view=PROJECTOR,
        camera_view=CAMERA,
    )


HAND = SceneDescription(
    summary="hand of wax with veins and creases, before a wall",
    projector=Size(64, 64),
    compute=ByRadiosity(hand),
    held_out=True,
)
