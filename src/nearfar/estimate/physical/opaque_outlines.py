"""Outlines of opaque surfaces, where a camera pixel sees two surfaces.

An estimate has direct light of one of them, that at q. Where photos did not show the second place,
direct light of the other surface is taken for inter-reflection, which then has a larger share of
the camera pixel's light than on either side. Light under white tells how much of each surface is
seen, and so how much inter-reflection there is. The rest is direct light from the other surface.

Index convention: arrays are (Cy, Cx, ...), a value for each camera pixel. Of two in a list, the
first is of the camera pixel some steps away in a direction, the second of one the other way.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Floats
from nearfar.estimate.physical.around import DIRECTIONS, longest_step_of_q, moved, steps_of_q
from nearfar.estimate.physical.elsewhere import Elsewhere, sees_single_pixels
from nearfar.estimate.physical.split import DARK, PhysicalSplit, opaque

# Steps on each side up to the camera pixels that may see one surface alone.
REACH = 2
# q of both sides is this far apart, in projector pixels and in steps of q from one camera pixel to
# the next, beyond what the camera pixels between them explain. At a crease it goes on.
LEAST_GAP = 2.0
# Share of each surface in what is seen, at least, and how far their mixture may be from the light
# under white, as a share of it. How all of these were chosen: docs/decisions/0111.
LEAST_SHARE = 0.3
LARGEST_MISFIT = 0.1


class _Mixed(NamedTuple):
    """Each camera pixel as a mixture of two others, on either side of it.

    Of several pairs, it is that whose larger share of inter-reflection is the least: other camera
    pixels of the outline have too much of it, too.

    Attributes
    ----------
    larger_share : ndarray, shape (Cy, Cx)
        Larger of the shares that inter-reflection has of both sides' light; infinite where no pair
        mixes to the camera pixel's light.
    interreflection : ndarray, shape (Cy, Cx, channels)
        Of the mixture.
    place : ndarray, shape (Cy, Cx, 2)
        Where on the projector the surface lies that q does not lie on.
    """

    larger_share: Floats
    interreflection: Floats
    place: Floats


def with_opaque_outlines(split: PhysicalSplit, creases: Booleans) -> PhysicalSplit:
    """Return a split with direct light from both surfaces at outlines of opaque surfaces.

    Parameters
    ----------
    split : PhysicalSplit
    creases : ndarray of bool, shape (Cy, Cx)
        Camera pixels at creases, which see two surfaces that meet.

    Returns
    -------
    PhysicalSplit
    """
    transport = split.transport
    shape, channels = transport.direct.shape, transport.channels
    white = np.ones(transport.projector, dtype=np.float32)
    parts = [np.reshape(part, shape) for part in split.components(white)]
    total, interreflection = np.maximum(np.asarray(sum(parts)), DARK), parts[2]
    sides = opaque(split)
    chosen = sides & ~creases & sees_single_pixels(split.footprint, transport.camera)
    chosen.ravel()[split.elsewhere.pixels] = False
    mixed = _mixed(split, total, interreflection, sides)
    pixels = np.flatnonzero(chosen & (_share(interreflection, total) > mixed.larger_share))
    more = np.maximum(interreflection - mixed.interreflection, 0.0).reshape(-1, channels)[pixels]
    others = Elsewhere(pixels, mixed.place.reshape(-1, 2)[pixels], more)
    return replace(split, elsewhere=split.elsewhere.and_also(others))


def _mixed(split: PhysicalSplit, total: Floats, interreflection: Floats, sides: Booleans) -> _Mixed:
    """Find for each camera pixel two on either side that mix to its light under white."""
    transport = split.transport
    q, step_of_q = transport.correspondence, steps_of_q(transport)
    least_gap = LEAST_GAP * longest_step_of_q(transport)
    far_corner = np.array(transport.projector) - 1.0
    best = _Mixed(np.full(sides.shape, np.inf), np.zeros_like(total), np.zeros_like(q))
    for direction in DIRECTIONS:
        for one, other in np.ndindex(REACH, REACH):
            steps = (one + 1) * direction, -(other + 1) * direction
            both = np.logical_and(*(moved(sides, step, False) for step in steps))
            lights, of_rest = (
                [moved(picture, step, 0.0) for step in steps]
                for picture in (total, interreflection)
            )
            # Where q would be here, if the surface on that side went on.
            places = [moved(q, step, np.nan) - step @ step_of_q for step in steps]
            gap = np.abs(places[0] - places[1]).max(axis=-1)
            weight, misfit = _mixture(total, *lights)
            larger_share = np.maximum(*map(_share, of_rest, lights))
            # Comparisons with NaN are false.
            fits = both & (gap > least_gap) & (np.minimum(weight, 1 - weight) > LEAST_SHARE)
            fits &= (misfit < LARGEST_MISFIT) & (larger_share < best.larger_share)
            off = [np.abs(place - q).max(axis=-1, keepdims=True) for place in places]
            place = np.clip(np.where(off[0] > off[1], *places), 0.0, far_corner)
            weight = weight[..., None]
            mixture = weight * of_rest[0] + (1 - weight) * of_rest[1]
            best = _Mixed(
                np.where(fits, larger_share, best.larger_share),
                np.where(fits[..., None], mixture, best.interreflection),
                np.where(fits[..., None], place, best.place),
            )
    return best


def _mixture(total: Floats, one: Floats, other: Floats) -> tuple[Floats, Floats]:
    """Return the weight of one light in a mixture with another, and its misfit, (Cy, Cx) each."""
    apart = one - other
    squares = np.maximum((apart**2).sum(axis=-1), DARK**2)
    weight = np.clip(((total - other) * apart).sum(axis=-1) / squares, 0.0, 1.0)
    left = total - other - weight[..., None] * apart
    return weight, np.abs(left).mean(axis=-1) / total.mean(axis=-1)


def _share(part: Floats, total: Floats) -> Floats:
    """Return the mean share over channels, (Cy, Cx)."""
    return np.asarray((part / np.maximum(total, DARK)).mean(axis=-1))
