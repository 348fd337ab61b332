"""Small transports that are not direct + near + far, to try estimators on.

The model of D, N and F holds for most scenes and for none of these: rows without direct light, rows
of several sharp paths, and rows whose places have no order. Each is exact, follows from its seed,
has one channel, and its brightest camera pixel is 0.9 under full white.

Index convention: c runs over camera pixels and p over projector pixels, both row by row; matrices
are (C, P).
"""

from collections.abc import Callable
from types import MappingProxyType

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.transport.direct import footprint
from nearfar.transport.exact import ExactTransport

# Brightest camera pixel under full white.
BRIGHTEST = 0.9
# Sharp paths from the projector to one camera pixel through a lens or by mirrors.
CAUSTIC_PATHS = 5
# Strands of hair that one camera pixel sees, and projector pixels between them.
STRANDS = 6
STRAND_DISTANCE = 2.5
# Offset of the reflection in a pane of glass from what is seen through it, in projector pixels.
GLASS_OFFSET = (1.3, 4.6)
# How sharply a glossy surface reflects a lamp: exponents of the cosine.
GLOSS = (8.0, 60.0)


def _dense(projector: Size, camera: Size, generator: np.random.Generator) -> Floats:
    """Draw entries that know nothing of one another."""
    return generator.uniform(size=(camera.pixels, projector.pixels))


def _caustics(projector: Size, camera: Size, generator: np.random.Generator) -> Floats:
    """Draw mirrors and lenses: a few bright, sharp paths to each camera pixel, over little else."""
    grid = _grid(camera)
    found = np.full((camera.pixels, projector.pixels), 0.02 / projector.pixels)
    for _ in range(CAUSTIC_PATHS):
        bent = grid + 0.3 * _waves(grid, generator, count=2)
        turned = bent @ generator.normal(0.0, 0.8, size=(2, 2)) + generator.uniform(size=2)
        # Folded back at the border, as light is in a mirror box.
        folded = np.abs((turned + 1.0) % 2.0 - 1.0)
        brightness = np.maximum(_waves(grid, generator, count=1)[:, 0] + 0.2, 0.0)
        found += _peaks(folded * (np.array(projector) - 1), projector) * brightness[:, None]
    return found


def _glass(projector: Size, camera: Size, generator: np.random.Generator) -> Floats:
    """Draw a pane of glass: everywhere what lies behind it and, aside from it, its reflections."""
    q = _grid(camera) * (np.array(projector) - 1)
    texture = generator.uniform(0.3, 1.0, size=(2, camera.pixels, 1))
    found = 0.6 * texture[0] * _peaks(q, projector)
    found += 0.4 * texture[1] * _peaks(_folded(q + np.array(GLASS_OFFSET), projector), projector)
    return np.asarray(found + 0.1 * _broad(projector, camera, generator) / projector.pixels)


def _hair(projector: Size, camera: Size, generator: np.random.Generator) -> Floats:
    """Draw thin strands at several depths: peaks finer than a pixel, some pixels apart."""
    q = _grid(camera) * (np.array(projector) - 1)
    found = 0.1 * _broad(projector, camera, generator) / projector.pixels
    for _ in range(STRANDS):
        aside = generator.normal(0.0, STRAND_DISTANCE, size=(camera.pixels, 2))
        brightness = generator.exponential(size=(camera.pixels, 1)) / STRANDS
        found = found + brightness * _peaks(_folded(q + aside, projector), projector)
    return np.asarray(found)


def _lamps(projector: Size, camera: Size, generator: np.random.Generator) -> Floats:
    """Draw a disc of lamps before a sphere: smooth, wide, and no projector pixel stands out."""
    place = 2.0 * _grid(projector) - 1.0
    lamps = np.stack([place[:, 0], place[:, 1], np.ones(len(place))], axis=1)
    lamps /= np.linalg.norm(lamps, axis=1, keepdims=True)
    inside = 0.65 * (2.0 * _grid(camera) - 1.0)
    bumps = inside + 0.05 * generator.normal(size=inside.shape)
    depth = np.sqrt(np.maximum(1.0 - np.sum(bumps**2, axis=1), 0.05))
    normals = np.concatenate([bumps, depth[:, None]], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    # The camera looks along the last axis.
    mirrored = 2.0 * normals[:, 2:] * normals - np.array([0.0, 0.0, 1.0])
    albedo = generator.uniform(0.2, 1.0, size=(camera.pixels, 1))
    found = albedo * np.maximum(normals @ lamps.T, 0.0)
    for exponent in GLOSS:
        found = found + 0.3 * np.maximum(mirrored @ lamps.T, 0.0) ** exponent
    disc = np.sum(place**2, axis=1) <= 1.05
    return np.asarray(found * disc)


def _permuted(projector: Size, camera: Size, generator: np.random.Generator) -> Floats:
    """Draw direct, near and far light, the projector's pixels then put into another order."""
    q = _grid(camera) * (np.array(projector) - 1)
    found = 0.6 * generator.uniform(0.3, 1.0, size=(camera.pixels, 1)) * _peaks(q, projector)
    pixels = np.stack(np.divmod(np.arange(projector.pixels), projector.width), axis=-1)
    distance = np.linalg.norm(q[:, None] - pixels, axis=-1)
    found = found + 0.03 * np.exp(-distance / 1.5)
    found = found + 0.2 * _broad(projector, camera, generator) / projector.pixels
    return np.asarray(found[:, generator.permutation(projector.pixels)])


HOSTILE: MappingProxyType[str, Callable[[Size, Size, np.random.Generator], Floats]] = (
    MappingProxyType(
        {
            "dense": _dense,
            "caustics": _caustics,
            "glass": _glass,
            "hair": _hair,
            "lamps": _lamps,
            "permuted": _permuted,
        }
    )
)


def hostile_transport(name: str, projector: Size, camera: Size, *, seed: int = 0) -> ExactTransport:
    """Draw a transport that is not direct + near + far.

    Parameters
    ----------
    name : str
        One of `HOSTILE`.
    projector, camera : Size
    seed : int

    Returns
    -------
    ExactTransport
        Of one channel, all of it in `far`.
    """
    matrix = HOSTILE[name](projector, camera, np.random.default_rng([seed, len(name)]))
    matrix = matrix * (BRIGHTEST / matrix.sum(axis=1).max())
    return ExactTransport(projector, camera, (), (), matrix[None].astype(np.float32), name)


def _grid(size: Size) -> Floats:
    """Return the places of pixels, (y, x) from 0 to 1, shape (pixels, 2)."""
    y, x = np.meshgrid(*(np.linspace(0.0, 1.0, side) for side in size), indexing="ij")
    return np.stack([y.ravel(), x.ravel()], axis=-1)


def _folded(q: Floats, projector: Size) -> Floats:
    """Fold places beyond the projector's border back onto it."""
    last = np.array(projector) - 1.0
    return np.asarray(last - np.abs(np.abs(q) - last))


def _peaks(q: Floats, projector: Size) -> Floats:
    """Return unit light from the 2 x 2 projector pixels around each q, shape (C, P)."""
    where = footprint(q, projector)
    found = np.zeros((len(q), projector.pixels))
    np.add.at(found, (np.arange(len(q))[:, None], where.pixels), where.weights)
    return found


def _waves(places: Floats, generator: np.random.Generator, *, count: int) -> Floats:
    """Return smooth functions of place with values about 1 in size, shape (n, count)."""
    cycles = generator.normal(0.0, 1.0, size=(3, 2, count))
    phase = generator.uniform(0.0, 2 * np.pi, size=(3, 1, count))
    return np.asarray(np.sin(2 * np.pi * (places @ cycles) + phase).mean(axis=0) * np.sqrt(3.0))


def _broad(projector: Size, camera: Size, generator: np.random.Generator) -> Floats:
    """Return smooth rows that change smoothly over the camera, mean about 1, shape (C, P)."""
    parts = 3
    over_projector = 1.0 + 0.5 * _waves(_grid(projector), generator, count=parts)
    over_camera = 1.0 + 0.5 * _waves(_grid(camera), generator, count=parts)
    return np.asarray(np.maximum(over_camera @ over_projector.T / parts, 0.0))
