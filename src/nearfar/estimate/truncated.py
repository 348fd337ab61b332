"""The variance of what a transport does not hold of far-range light."""

from collections.abc import Sequence

import numpy as np

from nearfar.arrays import Floats
from nearfar.illumination.frequencies import DC
from nearfar.priors.component import PriorComponent
from nearfar.priors.covariance import spectral_density
from nearfar.transport.model import Transport


def truncated_variance(
    transport: Transport, light: Floats, prior_components: Sequence[PriorComponent]
) -> Floats:
    """Return the variance of what the transport does not hold of f, under a light (P,).

    At unit prior scale, for each prior component: shape (components,). White is always held.
    """
    projector = transport.projector
    spectrum = np.abs(np.fft.fft2(light.reshape(projector).astype(np.float64))) ** 2
    held = (DC, *(k for k in transport.far_basis.frequencies if k != DC))
    for k in held:
        y, x = (round(part * side) for part, side in zip(k, projector, strict=True))
        spectrum[y % projector.height, x % projector.width] = 0.0
        spectrum[-y % projector.height, -x % projector.width] = 0.0
    # Far-range light has no detail that is finer than the coarsest functions.
    cycles = [np.fft.fftfreq(side) for side in projector]
    sampled = [np.flatnonzero(np.abs(one) <= 0.5 / transport.pitch) for one in cycles]
    spectrum = spectrum[np.ix_(*sampled)]
    down, across = (
        side * one[kept] for side, one, kept in zip(projector, cycles, sampled, strict=True)
    )
    radius = np.hypot(down[:, None], across)
    total = [np.sum(spectral_density(radius, one) * spectrum) for one in prior_components]
    return np.array(total) / projector.pixels**2
