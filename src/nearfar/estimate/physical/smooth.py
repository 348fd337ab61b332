"""Inter-reflection that is smooth over camera pixels.

Albedo cancels in the share that inter-reflection has of a camera pixel's light, so that this share
is smooth where surfaces are. What it deviates by from that of the camera pixels around is noise, as
far as the error bars of direct light explain it, and goes to direct light.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from nearfar.arrays import Booleans, Floats
from nearfar.estimate.physical.around import moved, steps
from nearfar.estimate.physical.split import DARK, PhysicalSplit, opaque, with_more_direct

# Share of the variance of direct light's error bars that makes inter-reflection deviate from that
# around it. Measured on wedge and corner.
BY_ERRORS = 0.7


def with_smooth_interreflection(
    split: PhysicalSplit, deviation: Floats, creases: Booleans
) -> PhysicalSplit:
    """Return a split whose inter-reflection is smooth at opaque surfaces.

    Parameters
    ----------
    split : PhysicalSplit
    deviation : ndarray, shape (Cy, Cx, channels)
        Standard deviation of direct light under white; infinite where nothing is known of it.
    creases : ndarray of bool, shape (Cy, Cx)
        Camera pixels where inter-reflection is not smooth.

    Returns
    -------
    PhysicalSplit
        Its ``own_share`` says how much of its own inter-reflection each camera pixel keeps.
    """
    transport = split.transport
    shape = transport.direct.shape
    chosen = opaque(split) & ~creases & np.isfinite(deviation).all(axis=-1)
    chosen.ravel()[split.elsewhere.pixels] = False
    white = np.ones(transport.projector, dtype=np.float32)
    parts = [np.reshape(part, shape) for part in split.components(white)]
    total = np.maximum(np.asarray(sum(parts)), DARK)
    share, noise = parts[2] / total, (deviation / total) ** 2
    mean, count = _mean_of_opposite(share, chosen)
    apart = (share - mean) * chosen[..., None]
    own_noise = np.where(chosen, noise.mean(axis=-1), 0.0)
    of_apart = _mean_about((apart**2).mean(axis=-1), chosen)
    # Shares of dark camera pixels are noisy, and tell little of those of bright ones.
    of_noise = np.minimum(own_noise, _mean_about(own_noise, chosen))
    tiny = np.finfo(np.float64).tiny
    gain = np.clip(1 - BY_ERRORS * of_noise / np.maximum(of_apart, tiny), 0.0, 1.0)
    gain[~chosen] = 1.0
    change = (1 - gain)[..., None] * apart * total
    # A mean of n has 1 / n of the camera pixel's own.
    own_share = gain + (1 - gain) / count
    return replace(with_more_direct(split, change), own_share=own_share)


def _mean_of_opposite(
    values: Floats, chosen: Booleans
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return means of each camera pixel and pairs of neighbours on either side of it, and counts.

    A plane through all these has this mean in the middle.
    """
    total, count = values.astype(np.float64), np.ones(chosen.shape)
    for step in steps(1)[:4]:
        both = moved(chosen, step, False) & moved(chosen, -step, False)
        pair = moved(values, step, 0.0) + moved(values, -step, 0.0)
        total += np.where(both[..., None], pair, 0.0)
        count += 2.0 * both
    return total / count[..., None], count


def _mean_about(values: Floats, chosen: Booleans) -> NDArray[np.float64]:
    """Return means of values over the chosen camera pixels in a square of 3 x 3."""
    counts, sums = (
        ndimage.uniform_filter(part, 3, mode="constant")
        for part in (chosen.astype(np.float64), np.where(chosen, values, 0.0))
    )
    return np.asarray(sums / np.maximum(counts, 1 / 9))
