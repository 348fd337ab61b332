"""Direct light of a second surface, where a camera pixel looks past a depth edge.

The model has direct light around one q. What a camera pixel sees of another surface is a second
spike, most often within the window. It is looked for where the responses, less what is explained,
agree with light at a single window entry: adding it must raise the evidence by far more than the
choice among all entries could by chance. Where a neighbour's own q lies on another surface, light
around that place is likely, and less evidence will do.

Index convention: arrays are (n, channels, ...); w runs over window entries.
"""

from math import log

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, beside, namespace
from nearfar.estimate.joint.pixels import Pixels
from nearfar.estimate.joint.prior import Prior
from nearfar.estimate.joint.solve import Found
from nearfar.transport import near

# Spikes at most: a second surface's footprint is up to four entries.
MOST = 4
# What a spike must add to the log evidence. Chance would ask for less, but windows that no kind
# fits well look like spikes too: at 12 false ones cost the coaxial box 0.2 dB under random light,
# at 80 true ones are missed.
SURE = 30.0
# The same where neighbours see another surface there.
LIKELY = 6.0
# Neighbours' q at least so far from a camera pixel's own, in projector pixels, lies on another
# surface.
APART = 1.5
# A spike of less than this share of white is not worth its place.
FAINTEST = 0.01


def likeliest_spike(
    pixels: Pixels, prior: Prior, ratio: Floats, found: Found
) -> tuple[Integers, Floats]:
    """Find the window entry at which a spike explains most of what is left.

    Returns
    -------
    entry : ndarray of int, shape (n,)
    gain : ndarray, shape (n,)
        What it adds to the log evidence, less the logarithm of the number of entries, and as
        much more as likely places need less; -inf where the spike would be faint or dark.
    """
    xp = namespace(ratio)
    step = xp.astype(xp.round(2 * xp.log2(ratio / float(prior.ratios[0]))), xp.int64)
    table = prior.curvatures[xp.clip(step, 0, len(prior.ratios) - 1)]
    curvature = table / pixels.noise[..., None] ** 2
    height = xp.sum(found.pull, axis=1) / xp.sum(curvature, axis=1)
    allowed = pixels.inside & beside(_apart(pixels.inside.shape[1]), pixels.inside)
    allowed &= height > FAINTEST * xp.mean(pixels.white, axis=1, keepdims=True)
    gain = 0.5 * xp.sum(found.pull**2 / curvature, axis=1) - log(pixels.inside.shape[1])
    gain = xp.where(allowed, gain + (SURE - LIKELY) * pixels.likely, -xp.inf)
    return xp.argmax(gain, axis=1), xp.max(gain, axis=1)


def _apart(entries: int) -> Booleans:
    """Window entries that are not next to q, shape (W^2,)."""
    return np.asarray(np.abs(near.offsets(round(np.sqrt(entries)))).max(axis=1) > 1)


def seen_beside(correspondence: Floats, window: int) -> Booleans:
    """Tell where in each window neighbours see another surface's direct light.

    Parameters
    ----------
    correspondence : ndarray, shape (Cy, Cx, 2)
    window : int
        W.

    Returns
    -------
    ndarray of bool, shape (C, W^2)
        Entries within one of the q of a neighbour, where that is on another surface.
    """
    height, width = correspondence.shape[:2]
    reach = window // 2
    padded = np.pad(correspondence, ((1, 1), (1, 1), (0, 0)), constant_values=np.nan)
    # A border of one for the entries around, cut off in the end.
    found = np.zeros((height, width, window + 2, window + 2), dtype=bool)
    for dy in range(3):
        for dx in range(3):
            off = padded[dy : dy + height, dx : dx + width] - correspondence
            apart = np.abs(off).max(axis=-1)
            y, x = np.nonzero((apart > APART) & (apart < reach + 1))
            place = np.rint(off[y, x]).astype(np.int64) + reach + 1
            for down in (-1, 0, 1):
                for across in (-1, 0, 1):
                    at = np.clip(place + np.array([down, across]), 0, window + 1)
                    found[y, x, at[:, 0], at[:, 1]] = True
    return found[:, :, 1:-1, 1:-1].reshape(height * width, window**2)


def with_spike(pixels: Pixels, entry: Integers) -> Pixels:
    """Add a spike at a window entry of each camera pixel to what is solved for."""
    xp = namespace(entry)
    return pixels._replace(spikes=xp.concat([pixels.spikes, entry[:, None]], axis=1))
