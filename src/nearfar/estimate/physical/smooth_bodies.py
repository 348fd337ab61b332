"""Inter-reflection of translucent bodies that is smooth over camera pixels.

Each camera pixel of a body decides alone how much of its light is direct and how much subsurface.
Inter-reflection is the rest, and has the errors of both. As a share of all light it changes slowly
over a body, since albedo cancels. What this share deviates by from a plane through those around it
goes to direct and subsurface light, as far as their error bars explain it.

Index convention: c runs over camera pixels on bodies.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers
from nearfar.estimate.physical.around import steps
from nearfar.estimate.physical.error_bars import (
    at_q_of_kernels,
    finite,
    root_left,
    taken_by_boxes,
)
from nearfar.estimate.physical.split import DARK, PhysicalSplit, on_bodies, with_more_direct

# Camera pixels on each side that a plane goes through, and how many of them there are at least.
REACH, LEAST_TELLING = 2, 6
# Weight of a plane's squared slope for each camera pixel that it is fitted to: at outlines, camera
# pixels on one side alone tell little of a slope.
LEVEL = 0.5
# Standard deviations by which neighbours are let err apart. Over the root of the share that kernels
# leave: of direct light, times what kernels add at q; of subsurface light, times itself. At least:
# as shares of the same. And of the estimate's own standard deviation of direct light.
OF_DIRECT, OF_SUBSURFACE = 0.75, 0.33
LEAST_OF_DIRECT, LEAST_OF_SUBSURFACE = 0.04, 0.05
OF_ESTIMATE = 0.5
# Correlation of both: what one gains the other loses.
CORRELATION = -0.65
# Share of their variance that is taken off: errors of a kernel are much the same all over a body.
# How these were chosen: docs/decisions/0110.
APART = 0.2
TINY = float(np.finfo(np.float64).tiny)


class _Planes(NamedTuple):
    """Planes through the shares of the camera pixels around each.

    Attributes
    ----------
    value : ndarray, shape (c, channels)
        At the camera pixel.
    left : ndarray, shape (c,)
        Sum of the squared distances of the others from it, mean over channels.
    number : ndarray, shape (c,)
        How many others there are.
    """

    value: Floats
    left: Floats
    number: Floats


def with_smooth_bodies(split: PhysicalSplit, deviation: Floats) -> PhysicalSplit:
    """Return a split whose inter-reflection is smooth on translucent bodies.

    Parameters
    ----------
    split : PhysicalSplit
    deviation : ndarray, shape (Cy, Cx, channels)
        Standard deviation of the estimate's direct light under white; infinite where nothing is
        known of it.

    Returns
    -------
    PhysicalSplit
    """
    if not split.bodies:
        return split
    transport, seen = split.transport, on_bodies(split)
    shape = (transport.camera.pixels, transport.channels)
    pixels = np.flatnonzero(seen)
    white = np.ones(transport.projector, dtype=np.float32)
    parts = np.stack([np.reshape(part, shape) for part in split.components(white)])
    total = np.maximum(parts.sum(axis=0), DARK)
    of_direct, of_under = _variances(split, deviation, parts[1])
    noise = of_direct + of_under + 2 * CORRELATION * np.sqrt(of_direct * of_under)
    noise = (noise / total**2).mean(axis=1)[pixels]
    share = parts[2] / total
    planes = _planes(share.reshape(*transport.camera, -1), seen, pixels)
    apart = share[pixels] - planes.value
    scatter = (planes.left + (apart**2).mean(axis=1)) / (planes.number + 1)
    lost = np.minimum(APART * noise / np.maximum(scatter, TINY), 1.0)
    lost *= planes.number >= LEAST_TELLING
    change = np.zeros(shape)
    change[pixels] = lost[:, None] * apart * total[pixels]
    # Each of the two takes the more of it, the less sure it is.
    to_direct = of_direct / np.maximum(of_direct + of_under, TINY)
    more_under = (1 - to_direct) * change / np.maximum(parts[1], DARK)
    factor = np.maximum(1 + more_under, 0.0)
    bodies = (
        body._replace(amplitude=body.amplitude * factor[body.pixels]) for body in split.bodies
    )
    split = replace(split, bodies=tuple(bodies))
    return with_more_direct(split, (to_direct * change).reshape(transport.direct.shape))


def _variances(split: PhysicalSplit, deviation: Floats, under: Floats) -> tuple[Floats, Floats]:
    """Return variances of direct and of subsurface light under white, (C, channels)."""
    of_direct, of_under = np.zeros(under.shape), np.zeros(under.shape)
    of_estimate = finite(deviation).reshape(under.shape)
    for body in split.bodies:
        left, pixels, taken = root_left(body), body.pixels, taken_by_boxes(split, body)
        by_kernel = np.hypot(OF_DIRECT * left, LEAST_OF_DIRECT) * at_q_of_kernels(body)
        of_direct[pixels] = by_kernel**2 + (OF_ESTIMATE * of_estimate[pixels]) ** 2 + taken**2
        share = np.hypot(OF_SUBSURFACE * left, LEAST_OF_SUBSURFACE)
        of_under[pixels] = (share * under[pixels]) ** 2 + taken**2
    return of_direct, of_under


def _planes(share: Floats, seen: Booleans, pixels: Integers) -> _Planes:
    """Fit planes to shares (Cy, Cx, channels) of camera pixels that are seen on bodies."""
    channels, width = share.shape[2], seen.shape[1] + 2 * REACH
    border = (REACH, REACH)
    values = np.pad(np.where(seen[..., None], share, 0.0), (border, border, (0, 0)))
    values, telling = values.reshape(-1, channels), np.pad(seen, REACH).ravel()
    y, x = np.divmod(pixels, seen.shape[1])
    normal = np.zeros((len(pixels), 3, 3))
    of_shares, squares = np.zeros((len(pixels), 3, channels)), np.zeros((len(pixels), channels))
    for down, across in steps(REACH):
        other = (y + REACH + down) * width + x + REACH + across
        terms = np.array([1.0, down, across])
        normal += telling[other, None, None] * np.outer(terms, terms)
        of_shares += terms[:, None] * values[other, None]
        squares += values[other] ** 2
    number = normal[:, 0, 0]
    # Where there is none, a plane of 0 solves the equations.
    level = (LEVEL * number)[:, None, None] * np.diag([0.0, 1.0, 1.0])
    level += (number == 0)[:, None, None] * np.eye(3)
    plane = np.linalg.solve(normal + level, of_shares)
    left = squares - (plane * (2 * of_shares - normal @ plane)).sum(axis=1)
    return _Planes(plane[:, 0], np.maximum(left, 0.0).mean(axis=1), number)
