"""A bookcase: spines of many colours, a glazed vase and a duck of soap, seen from aside."""

from functools import partial

import numpy as np
from scipy.interpolate import PchipInterpolator

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
    ball,
    box,
    lathe,
    quadrilateral,
    rotation,
    solid,
    transformed,
)

# Half the inner width, the depth, and the heights between the boards, in metres.
HALF, DEPTH = 0.62, 0.34
LOWER, UPPER = (0.0, 0.40), (0.425, 0.83)


def _grain(position: Floats) -> Floats:
    """Streaks along the boards."""
    x, y, z = np.moveaxis(position, -1, 0)
    return np.asarray(1 + 0.12 * np.sin(90 * (y - z) + 3 * np.sin(5 * x)))


def _bands(position: Floats, *, foot: float, height: float) -> Floats:
    """Draw a bright label and two dark rules across a spine."""
    u = (position[..., 1] - foot) / height
    rules = (np.abs(u - 0.12) < 0.04) | (np.abs(u - 0.92) < 0.04)
    return np.where(np.abs(u - 0.68) < 0.11, 1.35, np.where(rules, 0.45, 1.0))


WOOD = Material((0.60, 0.42, 0.26), texture=_grain)
LINING = Material((0.78, 0.73, 0.64))
PAGES = Material((0.78, 0.73, 0.60))
GLAZE = Material((0.06, 0.16, 0.42), gloss=Gloss(0.07, 60.0))
BEAK = Material((0.75, 0.28, 0.04))
BLACK = Material((0.03, 0.03, 0.03))
# As skin by Jensen et al. (2001) light spreads far in red and little in blue; thinned.
SOAP = Material(
    (0.10, 0.08, 0.07),
    gloss=Gloss(0.03, 30.0),
    medium=Medium((75.0, 85.0, 95.0), (1.5, 7.0, 12.0), 1.4),
)
RED, BLUE, GREEN = (0.55, 0.06, 0.07), (0.07, 0.12, 0.34), (0.06, 0.28, 0.12)
YELLOW, ORANGE, VIOLET = (0.62, 0.44, 0.08), (0.60, 0.22, 0.05), (0.28, 0.08, 0.36)
TEAL, BROWN, PINK = (0.08, 0.38, 0.42), (0.30, 0.16, 0.08), (0.60, 0.30, 0.36)
WHITE, DARK = (0.64, 0.60, 0.52), (0.04, 0.04, 0.05)
# Books from left to right: width, height, how far they stand back from the front, colour.
UPPER_BOOKS: tuple[tuple[float, float, float, Vector], ...] = (
    (0.075, 0.33, 0.14, RED),
    (0.055, 0.30, 0.13, WHITE),
    (0.065, 0.35, 0.12, BLUE),
    (0.045, 0.28, 0.11, YELLOW),
    (0.080, 0.31, 0.10, GREEN),
    (0.060, 0.34, 0.08, VIOLET),
    (0.050, 0.29, 0.12, ORANGE),
    (0.070, 0.32, 0.10, TEAL),
)
LOWER_BOOKS: tuple[tuple[float, float, float, Vector], ...] = (
    (0.070, 0.30, 0.12, BROWN),
    (0.055, 0.33, 0.08, PINK),
    (0.080, 0.28, 0.11, BLUE),
    (0.050, 0.34, 0.06, WHITE),
    (0.065, 0.31, 0.10, DARK),
    (0.075, 0.35, 0.12, RED),
    (0.060, 0.29, 0.07, YELLOW),
    (0.085, 0.32, 0.10, TEAL),
)

# Gap between books that touch (metres): a ray would meet either of two sides in one plane.
BOOK_GAP = 2e-5

PROJECTOR = View((-0.25, 0.72, 2.5), (0.0, 0.415, -0.1), 0.268)
CAMERA = View((0.32, 0.56, 2.4), (0.0, 0.415, -0.1), 0.255)


def _box(
    name: str, low: Vector, high: Vector, cover: Material, top: Material, *, sides: str
) -> list[Part]:
    """Make some sides of a box; others lie on what carries it."""
    mesh = box(low, high)
    ways = {"left": (0, -1), "right": (0, 1), "bottom": (1, -1), "top": (1, 1), "front": (2, 1)}
    parts = []
    for side in sides.split():
        axis, sign = ways[side]
        faces = np.asarray(mesh.faces)[sign * np.asarray(mesh.face_normals)[:, axis] > 0.5]
        material = top if side == "top" else cover
        parts.append(Part(f"{name} {side}", np.asarray(mesh.vertices), faces, material))
    return parts


def _case() -> list[Part]:
    across, up, inwards = (2 * HALF, 0.0, 0.0), (0.0, UPPER[1], 0.0), (0.0, 0.0, -DEPTH)
    outwards, aside, wide = (0.0, 0.0, DEPTH), (1.5 - HALF, 0.0, 0.0), (3.0, 0.0, 0.0)
    low, high = (-HALF, LOWER[1], -DEPTH), (HALF, UPPER[0], 0.0)
    return [
        quadrilateral("floor", (-HALF, 0.0, 0.0), across, inwards, WOOD),
        quadrilateral("ceiling", (-HALF, UPPER[1], -DEPTH), across, outwards, WOOD),
        quadrilateral("back", (-HALF, 0.0, -DEPTH), across, up, LINING),
        quadrilateral("left side", (-HALF, 0.0, 0.0), inwards, up, WOOD),
        quadrilateral("right side", (HALF, 0.0, -DEPTH), outwards, up, WOOD),
        quadrilateral("left front", (-1.5, 0.0, 0.0), aside, up, WOOD),
        quadrilateral("right front", (HALF, 0.0, 0.0), aside, up, WOOD),
        quadrilateral("top front", (-1.5, UPPER[1], 0.0), wide, (0.0, 0.5, 0.0), WOOD),
        quadrilateral("low front", (-1.5, -0.5, 0.0), wide, (0.0, 0.5, 0.0), WOOD),
        *_box("board", low, high, WOOD, WOOD, sides="top bottom front"),
    ]


def _row(
    start: float, foot: float, books: tuple[tuple[float, float, float, Vector], ...]
) -> list[Part]:
    """Stand books side by side from x = `start` on."""
    parts = []
    for index, (width, height, back, colour) in enumerate(books):
        texture = partial(_bands, foot=foot, height=height) if index % 3 else None
        low, high = (start, foot, -DEPTH), (start + width - BOOK_GAP, foot + height, -back)
        cover = Material(colour, texture=texture)
        name = f"book {foot} {index}"
        parts += _box(name, low, high, cover, PAGES, sides="left right top front")
        start += width
    return parts


def _stray_books() -> list[Part]:
    """Lay two books flat, and lean one on the upper row."""
    sides = "left right top front"
    low, high = (-0.59, 0.0, -0.32), (-0.14, 0.05, -0.02)
    atlas = _box("atlas", low, high, Material(GREEN), Material(GREEN), sides=sides)
    low, high = (-0.56, 0.05, -0.31), (-0.19, 0.085, -0.04)
    album = _box("album", low, high, Material(ORANGE), Material(WHITE), sides=sides)
    # Its lower left edge stands on the board.
    low, high = (-0.023, UPPER[0], -DEPTH), (0.027, 0.72, -0.09)
    leaning = _box("leaning book", low, high, Material(PINK), PAGES, sides=f"{sides} bottom")
    tilt = rotation(0.22, (0.0, 0.0, 1.0), point=low)
    return atlas + album + [transformed(part, tilt) for part in leaning]


def _vase(move: Vector) -> Part:
    corners = [(0.058, 0.0), (0.095, 0.08), (0.112, 0.15), (0.09, 0.22), (0.046, 0.275)]
    corners += [(0.046, 0.305), (0.064, 0.335), (0.055, 0.34), (0.04, 0.305), (0.0, 0.30)]
    smooth = PchipInterpolator(np.arange(len(corners)), corners)
    return solid("vase", lathe(smooth(np.linspace(0, len(corners) - 1, 91))), GLAZE, move=move)


def _duck(move: Vector) -> list[Part]:
    tail = ball((0.065, 0.025, 0.045))
    tail.apply_transform(rotation(-0.6, (0.0, 0.0, 1.0)))
    pieces = [
        ("duck body", ball((0.145, 0.09, 0.1)), (0.0, 0.08, 0.0), SOAP),
        ("duck tail", tail, (-0.13, 0.13, 0.0), SOAP),
        ("duck head", ball(0.072), (0.08, 0.205, 0.0), SOAP),
        ("duck beak", ball((0.042, 0.015, 0.032)), (0.155, 0.195, 0.015), BEAK),
        ("duck eye", ball(0.013, subdivisions=3), (0.108, 0.232, 0.054), BLACK),
    ]
    x, y, z = move
    return [
        solid(name, mesh, material, move=(x + right, y + up, z + ahead))
        for name, mesh, (right, up, ahead), material in pieces
    ]


def shelf() -> Scene:
    """Describe the bookcase; its projector stands on the left, its finer camera on the right."""
    return Scene(
        name="shelf",
        parts=(
            *_case(),
            *_row(0.03 - HALF, UPPER[0], UPPER_BOOKS),
            *_row(HALF - sum(width for width, *_ in LOWER_BOOKS), LOWER[0], LOWER_BOOKS),
            *_stray_books(),
            _vase((0.36, UPPER[0], -0.17)),
            *_duck((-0.4, 0.085, -0.155)),
        ),
        projector_view=PROJECTOR,
        camera_view=CAMERA,
    )


SHELF = SceneDescription(
    summary="books, glazed vase, duck of soap",
    projector=Size(60, 90),
    camera_scale=2,
    compute=ByRadiosity(shelf),
    held_out=True,
)
