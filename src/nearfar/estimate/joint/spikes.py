"""Direct light of a second surface, where a camera pixel lies on a depth edge.

The model has direct light around one q. Direct light of another surface is a second spike, most
often within the window. A spike at a window entry is accepted if it raises the evidence by far more
than chance could by the choice among all entries. Where a neighbour's q lies on another surface, a
spike near that q is expected, and a smaller gain in evidence is enough.

Index convention: arrays are (n, channels, ...); w runs over window entries.
"""

from functools import lru_cache
from math import log

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, beside, namespace
from nearfar.estimate.joint.batch import PixelBatch
from nearfar.estimate.joint.solve import PosteriorMean
from nearfar.illumination.near_basis import NearBasis, window_offsets
from nearfar.priors.responses import ResponsePrior

# Side of the square of projector pixels about q that direct light can touch.
FOOTPRINT_SIDE = 3
# A second surface's footprint is up to four entries.
MAXIMUM_SPIKES = 4
# Least gain in log evidence of an accepted spike. It is larger than chance alone requires, because
# windows that no prior component fits well look like spikes too: with 12, false spikes cost the
# coaxial box 0.2 dB under random light; with 80, true ones are missed.
LEAST_GAIN = 30.0
# The same where a neighbour sees another surface.
LEAST_EXPECTED_GAIN = 6.0
# A neighbour whose q is farther away than this, in projector pixels, sees another surface.
SURFACE_DISTANCE = 1.5
# Spikes fainter than this share of white are rejected.
FAINTEST_SPIKE = 0.01


def likeliest_spike(
    batch: PixelBatch, prior: ResponsePrior, ratio: Floats, found: PosteriorMean
) -> tuple[Integers, Floats]:
    """Find the window entry at which a spike raises the evidence most.

    Returns
    -------
    entry : ndarray of int, shape (n,)
    gain : ndarray, shape (n,)
        Gain in log evidence, less the logarithm of the number of entries, plus
        ``LEAST_GAIN - LEAST_EXPECTED_GAIN`` where a spike is expected; -inf where the spike would
        be faint or negative.
    """
    xp = namespace(ratio)
    octaves = xp.log2(ratio / float(prior.variance_ratios[0]))
    # Successive ratios of the table differ by a factor sqrt(2).
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


@lru_cache(maxsize=8)
def away_from_q(entries: int) -> Booleans:
    """Return which of W^2 window entries are not next to q, (W^2,); all callers share the array."""
    return np.asarray(np.abs(window_offsets(round(np.sqrt(entries)))).max(axis=1) > 1)


def around_q(window: int) -> Integers:
    """Return the 9 window entries next to q, in the order of `FOOTPRINT_OFFSETS`; none if W < 3."""
    return np.flatnonzero(~away_from_q(window**2)) if window >= FOOTPRINT_SIDE else np.arange(0)


def expected_spikes(correspondence: Floats, near_basis: NearBasis) -> Booleans:
    """Return the window entries at which neighbours see direct light of another surface.

    Parameters
    ----------
    correspondence : ndarray, shape (Cy, Cx, 2)
    near_basis : NearBasis

    Returns
    -------
    ndarray of bool, shape (C, W^2)
        Entries within one of the q of a neighbour, where that is on another surface. No entries
        where functions are of several projector pixels.
    """
    height, width = correspondence.shape[:2]
    if near_basis.pitch > 1:
        return np.zeros((height * width, 0), dtype=bool)
    window = near_basis.window
    reach = window // 2
    padded = np.pad(correspondence, ((1, 1), (1, 1), (0, 0)), constant_values=np.nan)
    # With a border of one entry, which is dropped in the end.
    found = np.zeros((height, width, window + 2, window + 2), dtype=bool)
    for dy in range(3):
        for dx in range(3):
            off = padded[dy : dy + height, dx : dx + width] - correspondence
            distance = np.abs(off).max(axis=-1)
            y, x = np.nonzero((distance > SURFACE_DISTANCE) & (distance < reach + 1))
            entry = np.rint(off[y, x]).astype(np.int64) + reach + 1
            for down in (-1, 0, 1):
                for across in (-1, 0, 1):
                    at = np.clip(entry + np.array([down, across]), 0, window + 1)
                    found[y, x, at[:, 0], at[:, 1]] = True
    return found[:, :, 1:-1, 1:-1].reshape(height * width, window**2)


def with_spike(batch: PixelBatch, entry: Integers) -> PixelBatch:
    """Return the batch with another spike, at the given window entry of each camera pixel."""
    xp = namespace(entry)
    return batch._replace(spikes=xp.concat([batch.spikes, entry[:, None]], axis=1))
