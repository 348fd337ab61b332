"""A marble bust in a niche of turquoise and gold, under a fluted dome."""

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
    lathe,
    rotation,
    sheet,
    solid,
)

RADIUS, DEPTH = 0.44, 0.62
# Height at which the dome begins, in metres.
DOME_HEIGHT = 0.62


def _flutes(position: Floats) -> Floats:
    """Eleven ribs that fan out from the foot of the dome at the back, as in a scallop shell."""
    fan = np.arctan2(position[..., 1] - DOME_HEIGHT + 0.02, position[..., 0])
    return np.asarray(1 + 0.16 * np.cos(22 * fan))


def _tiles(position: Floats) -> Floats:
    """Two tones in lozenges of 15 cm."""
    x, z = position[..., 0] / 0.15, position[..., 2] / 0.15
    return np.asarray(1 + 0.25 * (2 * ((np.floor(x + z) + np.floor(x - z)) % 2) - 1))


PLASTER = Material((0.56, 0.50, 0.42))
TURQUOISE = Material((0.10, 0.64, 0.70))
GOLD = Material((0.82, 0.52, 0.11), texture=_flutes)
CORNICE = Material((0.78, 0.74, 0.66))
STONE = Material((0.64, 0.58, 0.50), texture=_tiles)
PORPHYRY = Material((0.36, 0.09, 0.10), gloss=Gloss(0.03, 40.0))
# Marble as measured by Jensen et al. (2001), thinned and darkened so that light spreads over
# three (blue) to five (red) projector pixels of 64 across the niche.
MARBLE = Material(
    (0.12, 0.12, 0.12),
    gloss=Gloss(0.03, 25.0),
    medium=Medium((45.0, 50.0, 55.0), (0.6, 0.8, 1.4), 1.5),
)

VIEW = View((-0.3, 1.1, 2.75), (-0.005, 0.515, -0.1), 0.197)


# Size of the bust in the niche over that of its slices.
BUST_SCALE = 1.2
# The bust in slices: height, half width, half depth and how far it stands forward, in metres.
BUST_SLICES = np.array(
    [
        (0.000, 0.060, 0.055, 0.000),
        (0.040, 0.085, 0.065, 0.000),
        (0.110, 0.175, 0.090, 0.000),
        (0.190, 0.240, 0.105, 0.000),
        (0.235, 0.245, 0.105, 0.000),
        (0.275, 0.205, 0.095, 0.000),
        (0.305, 0.115, 0.080, 0.000),
        (0.335, 0.074, 0.074, 0.005),
        (0.370, 0.068, 0.068, 0.012),
        (0.395, 0.062, 0.075, 0.032),
        (0.420, 0.076, 0.092, 0.028),
        (0.460, 0.090, 0.108, 0.020),
        (0.510, 0.100, 0.120, 0.010),
        (0.560, 0.102, 0.124, 0.002),
        (0.610, 0.086, 0.104, 0.000),
        (0.640, 0.056, 0.070, 0.000),
        (0.655, 0.000, 0.000, 0.000),
    ]
)


def _niche() -> list[Part]:
    # The rim of the dome has the same corners as the arch in the wall: no light between them.
    around = np.linspace(np.pi, 0, 193)[:, None]
    across, upwards, inwards = np.eye(3) * (1, 1, -1)
    arc = RADIUS * np.cos(around) * across + DEPTH * np.sin(around) * inwards
    arch = RADIUS * (np.cos(around) * across + np.sin(around) * upwards)
    spring = DOME_HEIGHT * upwards
    tilt = np.linspace(0, np.pi / 2, 97)[:, None, None]
    dome = arc * np.cos(tilt) + RADIUS * upwards * np.sin(tilt) + spring
    outline = np.concatenate([arc[:1], arch + spring, arc[-1:]])
    ends = np.array([[-1.4, 0.0, 0.1], [1.4, 0.0, 0.1]])
    return [
        solid("niche wall", sheet([arc, arc + spring]), TURQUOISE),
        solid("dome", sheet(dome), GOLD),
        solid("floor", sheet([np.zeros_like(arc), arc]), STONE),
        solid("wall", sheet([outline, 3 * outline]), PLASTER),
        solid("sill", sheet([ends, ends * (1, 1, 0)]), CORNICE),
        solid("apron", sheet([ends - (0, 0.4, 0), ends]), CORNICE),
    ]


def _bust(move: Vector, turn: float) -> Part:
    """Carve the bust, 65 cm tall as drawn, turned about the y axis (radians)."""
    y = np.linspace(0, BUST_SLICES[-1, 0], 120)[:, None]
    wide, deep, ahead = np.moveaxis(
        PchipInterpolator(BUST_SLICES[:, 0], BUST_SLICES[:, 1:])(y), -1, 0
    )
    around = np.linspace(0, 2 * np.pi, 145)
    x, front = wide * np.sin(around), np.cos(around)

    def bump(height: float, side: float, size: float) -> Floats:
        return np.asarray(np.exp(-(((y - height) ** 2 + (np.abs(x) - side) ** 2) / size**2)))

    face = 0.034 * bump(0.478, 0, 0.022) + 0.014 * bump(0.505, 0, 0.018)
    face += 0.010 * bump(0.436, 0, 0.018) - 0.020 * bump(0.507, 0.040, 0.022)
    z = ahead + deep * front + np.where(front > 0, face, 0)
    points = np.stack(np.broadcast_arrays(x, y, z), axis=-1)
    # Locks of hair above a line from the brow to the nape, and a garment laid in folds.
    hair = 1 / (1 + np.exp(-(y - 0.50 - 0.055 * front) / 0.006)) * (y > 0.3)
    locks = hair * (0.09 + 0.05 * np.sin(9 * around) * np.cos(70 * y))
    folds = 0.05 * np.sin(70 * y + 25 * x) * np.exp(-(((y - 0.16) / 0.08) ** 4))
    points[..., [0, 2]] *= 1 + (locks + folds)[..., None]
    mesh = sheet(points)
    mesh.apply_transform(rotation(turn, (0.0, 1.0, 0.0)))
    mesh.apply_scale(BUST_SCALE)
    return solid("bust", mesh, MARBLE, move=move)


def alcove() -> Scene:
    """Describe the niche, under a coaxial camera."""
    socle = [(0.125, 0.0), (0.125, 0.03), (0.10, 0.045), (0.065, 0.09), (0.08, 0.12), (0.0, 0.12)]
    return Scene(
        name="alcove",
        parts=(
            *_niche(),
            solid("socle", lathe(socle), PORPHYRY, move=(0.0, 0.0, -0.22)),
            _bust((0.0, 0.12, -0.22), 0.1),
        ),
        projector_view=VIEW,
        camera_view=None,
    )


ALCOVE = SceneDescription(
    summary="marble bust in a niche of saturated colours",
    projector=Size(64, 64),
    compute=ByRadiosity(alcove),
    held_out=True,
)
