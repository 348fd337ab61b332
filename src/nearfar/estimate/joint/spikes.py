"""Direct light of a second surface, where a camera pixel lies on a depth edge.

The model has direct light around one q. What a camera pixel sees of another surface is a second
spike, most often within the window. A spike is accepted where the residual agrees with light at a
single window entry: adding it must raise the evidence by far more than the choice among all
entries could by chance. Where a neighbour's own q lies on another surface, a spike around that
place is expected, and less evidence is asked for.

Index convention: arrays are (n, channels, ...); w runs over window entries.
"""

from math import log

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, beside, namespace
from nearfar.estimate.joint.batch import PixelBatch
from nearfar.estimate.joint.solve import PosteriorMean
from nearfar.illumination.centred_basis import window_offsets
from nearfar.priors.responses import ResponsePrior

# A second surface's footprint is up to four entries.
MAXIMUM_SPIKES = 4
# What a spike must add to the log evidence. Chance would ask for less, but windows that no prior
# component fits well look like spikes too: at 12 false ones cost the coaxial box 0.2 dB under
# random light, at 80 true ones are missed.
LEAST_GAIN = 30.0
# The same where neighbours see another surface there.
LEAST_EXPECTED_GAIN = 6.0
# Projector pixels from which on a neighbour's q is on another surface than a camera pixel's own.
SURFACE_DISTANCE = 1.5
# Spikes fainter than this share of white are left out.
FAINTEST_SPIKE = 0.01


def likeliest_spike(
    batch: PixelBatch, prior: ResponsePrior, ratio: Floats, found: PosteriorMean
) -> tuple[Integers, Floats]:
    """Find the window entry at which a spike raises the evidence most.

    Returns
    -------
    entry : ndarray of int, shape (n,)
    gain : ndarray, shape (n,)
        What it adds to the log evidence, less the logarithm of the number of entries, plus
        ``LEAST_GAIN - LEAST_EXPECTED_GAIN`` where a spike is expected; -inf where the spike would
        be faint or negative.
    """
    xp = namespace(ratio)
    octaves = xp.log2(ratio / float(prior.variance_ratios[0]))
    # The ratios tabulated are half a power of 2 apart.
    step = xp.astype(xp.round(2 * octaves), xp.int64)
    table = prior.spike_information[xp.clip(step, 0, len(prior.variance_ratios) - 1)]
    information = table / batch.noise[..., None] ** 2
    height = xp.sum(found.score, axis=1) / xp.sum(information, axis=1)
    allowed = batch.inside & beside(away_from_q(batch.inside.shape[1]), batch.inside)
    allowed &= height > FAINTEST_SPIKE * xp.mean(batch.white, axis=1, keepdims=True)
    gain = 0.5 * xp.sum(found.score**2 / information, axis=1) - log(batch.inside.shape[1])
    bonus = (LEAST_GAIN - LEAST_EXPECTED_GAIN) * batch.spike_expected
    gain = xp.where(allowed, gain + bonus, -xp.inf)
    return xp.argmax(gain, axis=1), xp.max(gain, axis=1)


def away_from_q(entries: int) -> Booleans:
    """Return which of W^2 window entries are not next to q, shape (W^2,)."""
    return np.asarray(np.abs(window_offsets(round(np.sqrt(entries)))).max(axis=1) > 1)


def expected_spikes(correspondence: Floats, window: int) -> Booleans:
    """Return where in each window neighbours see another surface's direct light.

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
    # A border of one for the entries around, dropped in the end.
    found = np.zeros((height, width, window + 2, window + 2), dtype=bool)
    for dy in range(3):
        for dx in range(3):
            off = padded[dy : dy + height, dx : dx + width] - correspondence
            distance = np.abs(off).max(axis=-1)
            y, x = np.nonzero((distance > SURFACE_DISTANCE) & (distance < reach + 1))
            place = np.rint(off[y, x]).astype(np.int64) + reach + 1
            for down in (-1, 0, 1):
                for across in (-1, 0, 1):
                    at = np.clip(place + np.array([down, across]), 0, window + 1)
                    found[y, x, at[:, 0], at[:, 1]] = True
    return found[:, :, 1:-1, 1:-1].reshape(height * width, window**2)


def with_spike(batch: PixelBatch, entry: Integers) -> PixelBatch:
    """Add a spike at a window entry of each camera pixel to what is solved for."""
    xp = namespace(entry)
    return batch._replace(spikes=xp.concat([batch.spikes, entry[:, None]], axis=1))
