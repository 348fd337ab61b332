"""Direct light of translucent bodies that goes with all of their light.

The sum of direct and subsurface light is told far better than either: what one has too much of the
other lacks, in each camera pixel by itself. That shows as speckle in both. All light of a camera
pixel has no speckle, but has the edges of textures and shadows. What direct light deviates by from
planes and a multiple of all light around goes to subsurface light, as far as error bars explain it.
The mean of these changes over the camera pixels around is taken off again: dark camera pixels,
which are less sure, would gain direct light that no other one loses.
"""

import numpy as np
from scipy import ndimage

from nearfar.arrays import Booleans, Floats
from nearfar.estimate.physical.local_fits import REACH, guided_about, share_of_noise
from nearfar.estimate.physical.smooth_bodies import variances_apart
from nearfar.estimate.physical.split import (
    PhysicalSplit,
    on_bodies,
    with_more_direct,
    with_more_subsurface,
)

# Camera pixels on bodies that a fit goes through, at least: twice as many as it has terms.
LEAST_TELLING = 8
# Share of their variance that is taken off: errors of a kernel are much the same all over a body.
# How it was chosen: docs/decisions/0122.
APART = 0.4


def with_guided_direct_light(split: PhysicalSplit, deviation: Floats) -> PhysicalSplit:
    """Return a split whose direct and subsurface light have less speckle on translucent bodies.

    Parameters
    ----------
    split : PhysicalSplit
    deviation : ndarray, shape (Cy, Cx, channels)
        Standard deviation of the estimate's direct light under white; infinite where nothing is
        known of it.

    Returns
    -------
    PhysicalSplit
        Its inter-reflection under white is the same.
    """
    if not split.bodies:
        return split
    transport, seen = split.transport, on_bodies(split)
    shape = (transport.camera.pixels, transport.channels)
    pixels = np.flatnonzero(seen)
    white = np.ones(transport.projector, dtype=np.float32)
    parts = np.stack([np.reshape(part, shape) for part in split.components(white)])
    noise = np.minimum(*variances_apart(split, deviation, parts[1]))[pixels]
    fit = guided_about(
        parts[0].reshape(*transport.camera, -1),
        parts.sum(axis=(0, 2)).reshape(transport.camera),
        seen,
        pixels,
    )
    apart = parts[0, pixels] - fit.value
    lost = share_of_noise(fit, apart, APART * noise.mean(axis=1), LEAST_TELLING)
    of_all = np.zeros(shape)
    of_all[pixels] = -lost[:, None] * apart
    of_all -= _mean_about(of_all.reshape(*seen.shape, -1), seen).reshape(shape)
    # Neither becomes negative.
    change = np.clip(of_all, np.minimum(-parts[0], 0.0), np.maximum(parts[1], 0.0))
    split = with_more_subsurface(split, -change, parts[1])
    return with_more_direct(split, change.reshape(transport.direct.shape))


def _mean_about(values: Floats, seen: Booleans) -> Floats:
    """Return means over the squares about camera pixels, of those that see bodies: 0 elsewhere."""
    side = 2 * REACH + 1
    share = ndimage.uniform_filter(seen.astype(np.float64), side, mode="constant")
    mean = ndimage.uniform_filter(values, (side, side, 1), mode="constant")
    return np.asarray(mean * seen[..., None] / np.maximum(share, side**-2.0)[..., None])
