"""Which surfaces camera pixels at the outline of a translucent body see, and how much of each.

On either side of an outline there are camera pixels that see one surface alone. Where photos show a
second place, and it or q lies where the body goes on, direct light from both places tells the
mixture. Elsewhere light under white and direct light tell it.

Index convention: o runs over camera pixels at outlines, s over steps to the camera pixels around.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers
from nearfar.estimate.physical.around import longest_step_of_q, steps, steps_of_q
from nearfar.transport.model import Transport

# Camera pixels on each side that tell what is mixed.
REACH = 2
# Places on either side are this far apart, in projector pixels and in steps of q from one camera
# pixel to the next, or a camera pixel sees one surface.
LEAST_GAP = 1.5
# Shares nearer to 0 or 1 are no mixture.
LEAST_SHARE = 0.05
# A mixture that photos show no second place of must fit better by this factor in power than the
# surface at q alone.
GAIN = 2.0
# Or its inter-reflection, as a share of its light, is more by this factor than that of either side.
STANDS_OUT = 2.0
# Share of a body at q where inter-reflection stands out and light tells none. Camera pixels with a
# lesser share of the darker side's light see a shadow, and are left alone.
BODY_AT_Q, LEAST_BRIGHT = 0.9, 0.5
# Direct light that is more than that of a surface by this factor is not of that surface.
MOST_DIRECT = 1.5
# How well light under white is known from neighbours, and direct light: as a share of theirs, and
# of a floor in photo units.
OF_WHITE, OF_DIRECT = 0.05, 0.1
FLOOR = 0.02
TINY = float(np.finfo(np.float32).tiny)


class Side(NamedTuple):
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


class Mixtures(NamedTuple):
    """Camera pixels that see a body and something else.

    Attributes
    ----------
    found : ndarray of bool, shape (o,)
        Which camera pixels see both. At all others the fields below mean nothing.
    at_body : ndarray of bool, shape (o,)
        Whether q lies on the body.
    place : ndarray, shape (o, 2)
        Where on the projector the surface lies that q does not lie on.
    nearest : ndarray of int, shape (o,)
        A camera pixel, flattened, that sees the body alone.
    of_body, of_others : ndarray, shape (o, 3, channels)
        Components of each under white, all of which sum to the camera pixel's light.
    """

    found: Booleans
    at_body: Booleans
    place: Floats
    nearest: Integers
    of_body: Floats
    of_others: Floats

    def only_found(self) -> "Mixtures":
        """Return those of the camera pixels that see both."""
        return Mixtures._make(values[self.found] for values in self)


def mixtures(
    transport: Transport, pixels: Integers, parts: Floats, within: Booleans, beside: Booleans
) -> Mixtures:
    """Find out what camera pixels at outlines see.

    Parameters
    ----------
    transport : Transport
    pixels : ndarray of int, shape (o,)
        Flattened.
    parts : ndarray, shape (C, 3, channels)
        Components under white of all camera pixels.
    within, beside : ndarray of bool, shape (Cy, Cx)
        Camera pixels that see the body alone, and that do not see it.

    Returns
    -------
    Mixtures
    """
    sides = tuple(_side(transport, pixels, parts, seen) for seen in (within, beside))
    total = parts[pixels].sum(axis=1)
    by_place = _by_second_places(transport, pixels, total, *sides)
    by_light = _by_light(transport, pixels, parts[pixels], *sides)
    return Mixtures(
        by_place.found | by_light.found,
        *(
            np.where(by_place.found.reshape(-1, *(1,) * (one.ndim - 1)), one, other)
            for one, other in zip(by_place[1:], by_light[1:], strict=True)
        ),
    )


def _by_second_places(
    transport: Transport, pixels: Integers, total: Floats, within: Side, beside: Side
) -> Mixtures:
    """Find mixtures by direct light from q and from second places."""
    q, estimated = (
        values.reshape(transport.camera.pixels, -1)[pixels]
        for values in (transport.correspondence, transport.direct)
    )
    second: Floats = np.full(q.shape, np.nan)
    there: Floats = np.zeros(estimated.shape)
    if transport.second_place is not None and transport.second_direct is not None:
        second = transport.second_place.reshape(-1, 2)[pixels]
        there = transport.second_direct.reshape(-1, transport.channels)[pixels]
    least = LEAST_GAP * longest_step_of_q(transport)
    off_q, off_second = (_apart(places, within.place) for places in (q, second))
    at_body = off_q < off_second
    of_body, of_others = (np.where(here[:, None], estimated, there) for here in (at_body, ~at_body))
    # How much of each surface is seen, by how much of its direct light there is.
    of_it, of_rest = (
        np.maximum(direct.sum(axis=1), 0.0) / np.maximum(side.estimated.sum(axis=1), TINY)
        for direct, side in ((of_body, within), (of_others, beside))
    )
    expected = _apart(np.where(at_body[:, None], second, q), beside.place) < least
    known = expected & (of_rest < MOST_DIRECT)
    # Of a surface that no camera pixel about sees alone, direct light is known.
    alone = np.stack([of_others, *np.zeros((2, *of_others.shape))], axis=1)
    parts = np.where(known[:, None, None], of_rest[:, None, None] * beside.parts, alone)
    # Comparisons with NaN are false: where there is no second place, or no camera pixel.
    found = (np.minimum(off_q, off_second) < least) & (_apart(q, second) > least)
    found &= (known | np.isnan(beside.place[:, 0])) & (of_it < MOST_DIRECT)
    of_it = of_it[:, None, None] * within.parts
    return _mixtures(found, at_body, second, within.nearest, of_it, parts, total)


def _by_light(
    transport: Transport, pixels: Integers, parts: Floats, within: Side, beside: Side
) -> Mixtures:
    """Find mixtures by light under white and direct light from q."""
    total = parts.sum(axis=1)
    estimated = transport.direct.reshape(-1, transport.channels)[pixels]
    at_body = within.apart < beside.apart
    share, gain = _shares(total, estimated, within, beside, at_body)
    place = np.where(at_body[:, None], beside.place, within.place)
    place = np.clip(place, 0.0, np.array(transport.projector) - 1.0)
    # Comparisons with NaN are false: where one side is not known.
    found = _apart(within.place, beside.place) > LEAST_GAP * longest_step_of_q(transport)
    own, *others = (_share_of_rest(one) for one in (parts, within.parts, beside.parts))
    stands_out = own > STANDS_OUT * np.maximum(*others)
    found &= (gain > GAIN) | stands_out
    # Photos may take the direct light of a body at q for near-range light, and then tell no share.
    grey, *of_sides = (one.sum(axis=(1, 2)) for one in (parts, within.parts, beside.parts))
    in_light = grey > LEAST_BRIGHT * np.minimum(*of_sides)
    untold = at_body & stands_out & in_light & (share < LEAST_SHARE)
    share = np.where(untold, BODY_AT_Q, share)
    one, other = share[:, None, None] * within.parts, (1 - share[:, None, None]) * beside.parts
    return _mixtures(found, at_body, place, within.nearest, one, other, total)


def _share_of_rest(parts: Floats) -> Floats:
    """Return the share that inter-reflection has of all light, (o,)."""
    grey = parts.sum(axis=2)
    return np.asarray(grey[:, 2] / np.maximum(grey.sum(axis=1), TINY))


def _mixtures(
    found: Booleans,
    at_body: Booleans,
    place: Floats,
    nearest: Integers,
    of_body: Floats,
    of_others: Floats,
    total: Floats,
) -> Mixtures:
    """Return mixtures whose components sum to the total, without those that are hardly any."""
    one, other = of_body.sum(axis=1), of_others.sum(axis=1)
    mixed = np.maximum(one + other, TINY)
    share = one.sum(axis=1) / np.maximum((one + other).sum(axis=1), TINY)
    found = found & (share > LEAST_SHARE) & (share < 1 - LEAST_SHARE)
    scale = (total / mixed)[:, None]
    return Mixtures(found, at_body, place, nearest, scale * of_body, scale * of_others)


def _side(transport: Transport, pixels: Integers, parts: Floats, chosen: Booleans) -> Side:
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
    told = np.where(lit[..., None] > 0, places - about @ steps_of_q(transport), 0.0)
    off = np.abs(places - q[pixels, None]).max(axis=-1) / distance
    off = np.where(lit > 0, off, np.inf)
    best = off.argmin(axis=1)
    first = np.arange(len(pixels))
    estimated = transport.direct.reshape(-1, transport.channels)
    return Side(
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


def _apart(one: Floats, other: Floats) -> Floats:
    """Return the larger of the distances along both axes, (o,)."""
    return np.asarray(np.abs(one - other).max(axis=1))


def _shares(
    total: Floats, estimated: Floats, within: Side, beside: Side, at_body: Booleans
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
    steepness = np.maximum((slope**2).sum(axis=1), TINY)
    share = np.clip((slope * known).sum(axis=1) / steepness, 0.0, 1.0)

    def misfit(value: Floats) -> Floats:
        return np.asarray(((known - value[:, None] * slope) ** 2).sum(axis=1))

    alone = misfit(at_body.astype(np.float64))
    return share, alone / np.maximum(misfit(share), TINY)
