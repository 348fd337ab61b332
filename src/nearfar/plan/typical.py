"""Typical scenes that a plan is chosen for, or a quick first estimate of the real one."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats
from nearfar.errors import InputError
from nearfar.priors.covariance import spectral_density
from nearfar.priors.fitted import LIGHT_FROM_ANYWHERE, LIT_COMPONENTS, PRIOR_SCALES
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
        One scene. Camera pixels count by their squared light under white. Where they see a second
        place, it may be anywhere for a plan, which is made before it is found.

    Raises
    ------
    InputError
        If the transport was not estimated jointly.
    """
    posterior = _posterior_of(transport)
    energy = np.mean(posterior.white.astype(np.float64) ** 2, axis=-1).ravel()
    number, scale = _with_second_places(transport, posterior)
    octave = np.rint(np.log2(scale / PRIOR_SCALES[0])).astype(np.int64)
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


def _with_second_places(
    transport: "Transport", posterior: Posterior
) -> tuple[NDArray[np.int64], Floats]:
    """Return prior components and scales of camera pixels, (C,), second places among them."""
    number = posterior.prior_component.ravel().astype(np.int64)
    scale = posterior.prior_scale.ravel().astype(np.float64)
    if transport.second_direct is None:
        return number, scale
    seen = transport.second_direct.max(axis=-1).ravel() > 0
    share = np.mean(transport.second_direct / posterior.white, axis=-1).ravel()[seen]
    (anywhere,) = (n for n, one in enumerate(LIT_COMPONENTS) if one == LIGHT_FROM_ANYWHERE)
    # Light from one place responds to all frequencies alike.
    deviation = np.sqrt(spectral_density(np.zeros(1), LIGHT_FROM_ANYWHERE)[0])
    number[seen] = anywhere
    scale[seen] = np.clip(share / deviation, PRIOR_SCALES[0], PRIOR_SCALES[-1])
    return number, scale


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
