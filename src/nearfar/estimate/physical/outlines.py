"""Camera pixels at the outline of a translucent body that see something else beside it.

From aside, a camera pixel at an outline sees two places that are far from each other on the
projector. An estimate has direct light of one of them, or of both, and no kernel fits the light of
both. All its components are a mixture of those of the camera pixels on either side.

Index convention: o runs over camera pixels at outlines.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from nearfar.arrays import Booleans, Floats, Integers
from nearfar.estimate.physical.elsewhere import Elsewhere, sees_single_pixels
from nearfar.estimate.physical.mixtures import mixtures
from nearfar.estimate.physical.split import PhysicalSplit, Translucent
from nearfar.estimate.physical.translucent import SQUARE

# Where kernels explain a lesser share of what direct light leaves, nothing is translucent: a whole
# body, or camera pixels at its outline.
LEAST_EXPLAINED = 0.8


def with_outlines(split: PhysicalSplit) -> PhysicalSplit:
    """Return a split whose outlines of translucent bodies are mixtures, where they see two places.

    Parameters
    ----------
    split : PhysicalSplit

    Returns
    -------
    PhysicalSplit
    """
    transport = split.transport
    camera, channels = transport.camera, transport.channels
    body_of, explained = np.full(camera.pixels, -1), np.zeros(camera.pixels)
    for number, body in enumerate(split.bodies):
        body_of[body.pixels], explained[body.pixels] = number, body.explained
    good = (explained >= LEAST_EXPLAINED).reshape(camera)
    doubted = ndimage.binary_dilation(good, SQUARE) | (body_of >= 0).reshape(camera)
    doubted &= transport.lit & ~good & sees_single_pixels(split.footprint, camera)
    pixels = np.flatnonzero(doubted)
    white = np.ones(transport.projector, dtype=np.float32)
    parts = np.stack([np.reshape(p, (-1, channels)) for p in split.components(white)], axis=1)
    found = mixtures(transport, pixels, parts, good, ~good & ~doubted)
    pixels, mixed = pixels[found.found], found.only_found()
    at_body = mixed.at_body[:, None]
    direct = split.direct.reshape(-1, channels).copy()
    direct[pixels] = np.where(at_body, mixed.of_body[:, 0], mixed.of_others[:, 0])
    other = np.where(at_body, mixed.of_others[:, 0], mixed.of_body[:, 0])
    elsewhere = split.elsewhere.and_also(Elsewhere(pixels, mixed.place, other))
    q = transport.correspondence.reshape(-1, 2)[pixels]
    where = np.where(at_body, q, mixed.place)
    subsurface = mixed.of_body[:, 1] + mixed.of_others[:, 1]
    bodies = tuple(
        _with_pixels(body, here, pixels, where, mixed.nearest, subsurface, split)
        for body, here in (
            (body, body_of[mixed.nearest] == number) for number, body in enumerate(split.bodies)
        )
    )
    return replace(
        split, direct=direct.reshape(split.direct.shape), elsewhere=elsewhere, bodies=bodies
    )


def _with_pixels(
    body: Translucent,
    here: Booleans,
    pixels: Integers,
    places: Floats,
    nearest: Integers,
    subsurface: Floats,
    split: PhysicalSplit,
) -> Translucent:
    """Return a body with camera pixels that see it at some places, and have some light under it."""
    kept = ~np.isin(body.pixels, pixels)
    alike = np.searchsorted(body.pixels, nearest[here])
    added = body._replace(
        pixels=pixels[here],
        places=places[here],
        slope=body.slope[alike],
        amplitude=np.ones_like(body.amplitude[alike]),
        explained=body.explained[alike],
    )
    transport = split.transport
    white = np.ones((1, transport.projector.pixels))
    unit = added.under(white, transport.projector)
    amplitude = subsurface[here] / np.maximum(unit, np.finfo(np.float32).tiny)
    added = added._replace(amplitude=amplitude)
    order = np.argsort(np.concatenate([body.pixels[kept], added.pixels]))

    def joined(old: NDArray[Any], new: NDArray[Any]) -> NDArray[Any]:
        return np.asarray(np.concatenate([old[kept], new])[order])

    return body._replace(
        pixels=joined(body.pixels, added.pixels),
        places=joined(body.places, added.places),
        slope=joined(body.slope, added.slope),
        amplitude=joined(body.amplitude, added.amplitude),
        explained=joined(body.explained, added.explained),
    )
