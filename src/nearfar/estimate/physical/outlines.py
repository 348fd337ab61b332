"""Camera pixels at the outline of a translucent body that see something else beside it.

From aside, a camera pixel at an outline sees two places that are far from each other on the
projector. An estimate has direct light of one of them, and no kernel fits the light of both. All
its components are a mixture of those of the camera pixels on either side, and how much of each, its
light under white and its direct light tell.

Index convention: o runs over camera pixels at outlines, s over steps to the camera pixels around.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from nearfar.arrays import Booleans, Floats, Integers
from nearfar.estimate.physical.around import steps
from nearfar.estimate.physical.elsewhere import Elsewhere, sees_single_pixels
from nearfar.estimate.physical.split import PhysicalSplit, Translucent
from nearfar.estimate.physical.translucent import SQUARE
from nearfar.transport.model import Transport

# Where kernels explain a lesser share of what direct light leaves, nothing is translucent: a whole
# body, or camera pixels at its outline.
LEAST_EXPLAINED = 0.8
# Camera pixels on each side that tell what is mixed.
REACH = 2
# Places on either side are this far apart, in projector pixels and in steps of q from one camera
# pixel to the next, or a camera pixel sees one surface.
LEAST_GAP = 1.5
# Shares nearer to 0 or 1 are no mixture.
LEAST_SHARE = 0.05
# A mixture must fit better by this factor in power than the surface at q alone.
GAIN = 2.0
# How well light under white is known from neighbours, and direct light: as a share of theirs, and
# of a floor in photo units.
OF_WHITE, OF_DIRECT = 0.05, 0.1
FLOOR = 0.02


class _Side(NamedTuple):
    """What is seen on one side of outlines: means over camera pixels around, weighed by distance.

    Attributes
    ----------
    parts : ndarray, shape (o, 3, channels)
        Components under white; NaN where there is no camera pixel.
    estimated : ndarray, shape (o, channels)
        Direct light as the estimate has it.
    place : ndarray, shape (o, 2)
        q that it would have at the outline; NaN where none has direct light.
    nearest : ndarray of int, shape (o,)
        The camera pixel among them, flattened, whose q is the most like that at the outline.
    apart : ndarray, shape (o,)
        How far its q is from that at the outline, over the distance of the camera pixels.
    """

    parts: Floats
    estimated: Floats
    place: Floats
    nearest: Integers
    apart: Floats

    def of(self, chosen: Booleans) -> "_Side":
        """Return those of some outlines."""
        return _Side(
            self.parts[chosen],
            self.estimated[chosen],
            self.place[chosen],
            self.nearest[chosen],
            self.apart[chosen],
        )


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
    within = _side(transport, pixels, parts, good)
    beside = _side(transport, pixels, parts, ~good & ~doubted)
    total = parts[pixels].sum(axis=1)
    at_body = within.apart < beside.apart
    estimated = transport.direct.reshape(-1, channels)[pixels]
    share, gain = _shares(total, estimated, within, beside, at_body)
    pace = max(1.0, float(np.abs(_jacobian(transport)).max()))
    # Comparisons with NaN are false: where one side is not known.
    chosen = np.abs(within.place - beside.place).max(axis=1) > LEAST_GAP * pace
    chosen &= (share > LEAST_SHARE) & (share < 1 - LEAST_SHARE) & (gain > GAIN)
    pixels, within, beside = pixels[chosen], within.of(chosen), beside.of(chosen)
    at_body, share = at_body[chosen], share[chosen, None, None]
    sides = np.stack([share * within.parts, (1 - share) * beside.parts])
    mixed = sides.sum(axis=(0, 2))
    sides *= (total[chosen] / np.maximum(mixed, np.finfo(np.float32).tiny))[:, None]
    places = transport.correspondence.reshape(-1, 2)
    of_body, of_others = sides[:, :, 0]
    own = np.where(at_body[:, None], of_body, of_others)
    other = np.where(at_body[:, None], of_others, of_body)
    direct = split.direct.reshape(-1, channels).copy()
    direct[pixels] = own
    others = places[np.where(at_body, beside.nearest, within.nearest)]
    elsewhere = split.elsewhere.and_also(Elsewhere(pixels, others, other))
    where = np.where(at_body[:, None], places[pixels], places[within.nearest])
    bodies = tuple(
        _with_pixels(body, here, pixels, where, within.nearest, sides[:, :, 1].sum(axis=0), split)
        for body, here in (
            (body, body_of[within.nearest] == number) for number, body in enumerate(split.bodies)
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


def _side(transport: Transport, pixels: Integers, parts: Floats, chosen: Booleans) -> _Side:
    """Look at the chosen camera pixels around outlines."""
    camera = transport.camera
    about = steps(REACH)
    y, x = (np.stack(np.divmod(pixels, camera.width), axis=-1)[:, None] + about).transpose(2, 0, 1)
    inside = (y >= 0) & (y < camera.height) & (x >= 0) & (x < camera.width)
    around = np.where(inside, y * camera.width + x, 0)
    distance = np.hypot(*about.T)
    weight = (chosen.ravel()[around] & inside) / distance**2
    lit = weight * transport.lit.ravel()[around]
    q = transport.correspondence.reshape(-1, 2)
    places = np.where(lit[..., None] > 0, q[around], 0.0)
    told = np.where(lit[..., None] > 0, places - about @ _jacobian(transport), 0.0)
    off = np.abs(places - q[pixels, None]).max(axis=-1) / distance
    off = np.where(lit > 0, off, np.inf)
    best = off.argmin(axis=1)
    first = np.arange(len(pixels))
    estimated = transport.direct.reshape(-1, transport.channels)
    return _Side(
        _mean(parts[around], weight),
        _mean(estimated[around], weight),
        _mean(told, lit),
        around[first, best],
        off[first, best],
    )


def _mean(values: Floats, weight: Floats) -> Floats:
    """Return weighed means over s of values (o, s, ...); NaN where nothing weighs."""
    total = weight.sum(axis=1)
    sums = np.einsum("os,os...->o...", weight, values)
    known = np.where(total > 0, total, np.nan)
    return np.asarray(sums / known.reshape(-1, *(1,) * (sums.ndim - 1)))


def _jacobian(transport: Transport) -> NDArray[np.float64]:
    """Return by how much q moves, in the median, from one camera pixel to the next: (2, 2).

    A row for a step down and one for a step across.
    """
    q = np.where(transport.lit[..., None], transport.correspondence, np.nan)
    apart = [np.diff(q, axis=axis).reshape(-1, 2) for axis in (0, 1)]
    known = [one[np.isfinite(one).all(axis=1)] for one in apart]
    return np.stack([np.median(one, axis=0) if len(one) else np.zeros(2) for one in known])


def _shares(
    total: Floats, estimated: Floats, within: _Side, beside: _Side, at_body: Booleans
) -> tuple[Floats, Floats]:
    """Return which share of each outline is the body, and how much better a mixture fits, (o,)."""
    one, other = within.parts.sum(axis=1), beside.parts.sum(axis=1)
    # Direct light of the estimate is that of the side on which q lies.
    with_body, without = (
        np.where(here[:, None], side.estimated, 0.0)
        for here, side in ((at_body, within), (~at_body, beside))
    )
    known = np.concatenate([total - other, estimated - without], axis=1)
    slope = np.concatenate([one - other, with_body - without], axis=1)
    scale = np.concatenate(
        [OF_WHITE * (total + FLOOR), OF_DIRECT * (with_body + without + FLOOR)], axis=1
    )
    known, slope = known / scale, slope / scale
    steepness = np.maximum((slope**2).sum(axis=1), np.finfo(np.float32).tiny)
    share = np.clip((slope * known).sum(axis=1) / steepness, 0.0, 1.0)

    def misfit(value: Floats) -> Floats:
        return np.asarray(((known - value[:, None] * slope) ** 2).sum(axis=1))

    alone = misfit(at_body.astype(np.float64))
    return share, alone / np.maximum(misfit(share), np.finfo(np.float32).tiny)
