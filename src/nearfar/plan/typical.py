"""Typical scenes that a plan is chosen for, or a quick first estimate of the real one."""

from typing import TYPE_CHECKING

import numpy as np

from nearfar.errors import InputError
from nearfar.priors.fitted import PRIOR_SCALES
from nearfar.priors.typical import TypicalScenes
from nearfar.transport.posterior import Posterior

if TYPE_CHECKING:
    # A plan needs none of what a transport computes with.
    from nearfar.transport.model import Transport

# Prior scales of one component within this many octaves are put together.
OCTAVES_TOGETHER = 2
# A group with less than this share of a scene's squared light is left out.
SHARE_FLOOR = 5e-4


def typical_of(transport: "Transport") -> TypicalScenes:
    """Return the mixture of prior components that a joint estimate found.

    Parameters
    ----------
    transport : Transport
        From a quick look at the scene: few photos, estimated jointly.

    Returns
    -------
    TypicalScenes
        One scene. Camera pixels count by their squared light under white.

    Raises
    ------
    InputError
        If the transport was not estimated jointly.
    """
    posterior = _posterior_of(transport)
    energy = np.mean(posterior.white.astype(np.float64) ** 2, axis=-1).ravel()
    scale = posterior.prior_scale.ravel()
    octave = np.rint(np.log2(scale / PRIOR_SCALES[0])).astype(np.int64)
    number = posterior.prior_component.ravel().astype(np.int64)
    group = number * len(PRIOR_SCALES) + octave // OCTAVES_TOGETHER
    found, member = np.unique(group, return_inverse=True)
    shares = np.bincount(member, energy)
    squared = np.bincount(member, energy * scale.astype(np.float64) ** 2)
    kept = np.flatnonzero(shares >= SHARE_FLOOR * shares.sum())
    prior_components = tuple(
        (
            posterior.prior_components[found[i] // len(PRIOR_SCALES)],
            float(np.sqrt(squared[i] / shares[i])),
        )
        for i in kept
    )
    return TypicalScenes(prior_components, (shares[kept] / shares[kept].sum())[None], np.ones(1))


def noise_of(transport: "Transport") -> float:
    """Return the noise of a response in a joint estimate, as a share of white, over all pixels.

    Raises
    ------
    InputError
        If the transport was not estimated jointly.
    """
    posterior = _posterior_of(transport)
    noise = transport.noise.astype(np.float64)
    return float(np.sqrt(np.mean(noise**2) / np.mean(posterior.white.astype(np.float64) ** 2)))


def _posterior_of(transport: "Transport") -> Posterior:
    if not isinstance(transport.posterior, Posterior):
        raise InputError(
            "this transport holds no prior components to plan for: reconstruct the quick look with "
            "`method='joint'`."
        )
    return transport.posterior
