"""Inter-reflection of translucent bodies that is smooth over camera pixels.

Each camera pixel of a body decides alone how much of its light is direct and how much subsurface.
Inter-reflection is the rest, and has the errors of both. As a share of all light it changes slowly
over a body, since albedo cancels. What this share deviates by from a plane through those around it
goes to direct and subsurface light, as far as their error bars explain it.

Index convention: c runs over camera pixels on bodies.
"""

import numpy as np

from nearfar.arrays import Floats
from nearfar.estimate.physical.error_bars import (
    at_q_of_kernels,
    finite,
    root_left,
    taken_by_boxes,
)
from nearfar.estimate.physical.local_fits import TINY, planes_about, share_of_noise
from nearfar.estimate.physical.split import (
    DARK,
    PhysicalSplit,
    on_bodies,
    with_more_direct,
    with_more_subsurface,
)

# Camera pixels on bodies that a plane goes through, at least.
LEAST_TELLING = 6
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
    of_direct, of_under = variances_apart(split, deviation, parts[1])
    noise = of_direct + of_under + 2 * CORRELATION * np.sqrt(of_direct * of_under)
    noise = (noise / total**2).mean(axis=1)[pixels]
    share = parts[2] / total
    planes = planes_about(share.reshape(*transport.camera, -1), seen, pixels)
    apart = share[pixels] - planes.value
    lost = share_of_noise(planes, apart, APART * noise, LEAST_TELLING)
    change = np.zeros(shape)
    change[pixels] = lost[:, None] * apart * total[pixels]
    # Each of the two takes the more of it, the less sure it is.
    to_direct = of_direct / np.maximum(of_direct + of_under, TINY)
    split = with_more_subsurface(split, (1 - to_direct) * change, parts[1])
    return with_more_direct(split, (to_direct * change).reshape(transport.direct.shape))


def variances_apart(
    split: PhysicalSplit, deviation: Floats, under: Floats
) -> tuple[Floats, Floats]:
    """Return by how much neighbours are let err apart.

    Parameters
    ----------
    split : PhysicalSplit
    deviation : ndarray, shape (Cy, Cx, channels)
        As for `with_smooth_bodies`.
    under : ndarray, shape (C, channels)
        Subsurface light under white.

    Returns
    -------
    of_direct, of_under : ndarray, shape (C, channels)
        Variances of direct and of subsurface light under white; 0 where no body is seen.
    """
    of_direct, of_under = np.zeros(under.shape), np.zeros(under.shape)
    of_estimate = finite(deviation).reshape(under.shape)
    for body in split.bodies:
        left, pixels, taken = root_left(body), body.pixels, taken_by_boxes(split, body)
        by_kernel = np.hypot(OF_DIRECT * left, LEAST_OF_DIRECT) * at_q_of_kernels(body)
        of_direct[pixels] = by_kernel**2 + (OF_ESTIMATE * of_estimate[pixels]) ** 2 + taken**2
        share = np.hypot(OF_SUBSURFACE * left, LEAST_OF_SUBSURFACE)
        of_under[pixels] = (share * under[pixels]) ** 2 + taken**2
    return of_direct, of_under
