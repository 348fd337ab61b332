"""Prior components by how they foretell frequencies that were not measured.

Most of the error of a picture can lie at frequencies that no photo shows, and most of these are
high where most measured ones are low. A component that fits the low ones well may say far too
little of the high ones. For the error bars, each measured response therefore counts for the
unmeasured ones about it as well (Shimodaira, J. Stat. Plan. Inference 90, 2000: weighted likelihood
under covariate shift).

Index convention: r runs over real responses.
"""

import numpy as np
from array_api_compat import device

from nearfar.arrays import Floats, beside, namespace
from nearfar.estimate.joint.batch import PixelBatch
from nearfar.estimate.joint.evidence import PriorSet
from nearfar.illumination.real_basis import RealBasis
from nearfar.priors.fitted import PRIOR_SCALES

# Power of the counts. With 1, a few responses decide, and by chance; with 0, none count for others.
FLATTENING = 0.5


def responses_stood_for(basis: RealBasis) -> Floats:
    """Return for how many responses each measured one stands, shape (R,), float64; at least 1.

    All responses of the projector's DFT in a ring of one cycle are shared evenly by the measured
    ones in it, or in the nearest ring that has any.

    Parameters
    ----------
    basis : RealBasis
        The measured frequencies without DC.
    """
    sides = basis.projector
    cycles = np.hypot(*(basis.cycles * np.array(sides)).T)[basis.index]
    rings, ring, measured = np.unique(np.rint(cycles), return_inverse=True, return_counts=True)
    down, across = (side * np.fft.fftfreq(side) for side in sides)
    every = np.rint(np.hypot(down[:, None], across)).ravel()[1:]
    above = np.clip(np.searchsorted(rings, every), 1, max(1, len(rings) - 1))
    below = above - 1
    above = np.minimum(above, len(rings) - 1)
    nearest = np.where(every - rings[below] <= rings[above] - every, below, above)
    shared = np.bincount(nearest, minlength=len(rings)) / measured
    return np.asarray(np.maximum(shared[ring], 1.0))


def log_scores(
    batch: PixelBatch, candidates: PriorSet, multiplicity: Floats, stood_for: Floats
) -> Floats:
    """Return weighted log evidences of components without direct and near-range light.

    Parameters
    ----------
    batch : PixelBatch
    candidates : PriorSet
        Far-range light alone, whose responses are independent of one another.
    multiplicity : ndarray, shape (R,)
        How often each response was measured.
    stood_for : ndarray, shape (R,)
        As `responses_stood_for` returns them.

    Returns
    -------
    ndarray, shape (candidates, n, scales), float64
        Up to a constant of the camera pixel.
    """
    xp = namespace(batch.white)
    weights = beside(stood_for**FLATTENING, batch.responses)
    squares = xp.astype(batch.responses, xp.float64) ** 2
    noise = xp.astype(batch.noise[..., None], xp.float64) ** 2 / multiplicity
    white = xp.astype(batch.white[..., None], xp.float64) ** 2
    shape = (len(candidates.priors), len(white), len(PRIOR_SCALES))
    found: Floats = xp.empty(shape, dtype=xp.float64, device=device(white))
    for place, prior in enumerate(candidates.priors):
        at_white = white * beside(prior.far_variance, white)
        for step, scale in enumerate(PRIOR_SCALES):
            variance = scale**2 * at_white + noise
            misfit = (squares / variance + xp.log(variance)) @ weights
            found[place, :, step] = -0.5 * xp.sum(misfit, axis=1)
    return found
