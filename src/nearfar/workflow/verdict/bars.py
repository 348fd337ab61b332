"""Error bars of a transport whose relit pictures are compared with photos."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Floats
from nearfar.estimate.error_bars import ErrorBars
from nearfar.transport.model import Transport
from nearfar.transport.posterior import AnyPosterior, Posterior

# Noise is scaled by this to find the error that photos without noise would leave.
NOISE_FACTOR = 1e-3


class Bars(NamedTuple):
    """Error bars of a transport, and those of the same photos with hardly any noise."""

    of_all: ErrorBars
    of_unmeasured: ErrorBars


def bars_of(transport: Transport) -> Bars | None:
    """Return the error bars of a transport; None if its estimate gives none.

    A verdict that it has already does not widen them.
    """
    posterior = transport.posterior
    if posterior is None:
        return None
    transport = replace(transport, verdict=None)
    without_noise = replace(
        transport, noise=NOISE_FACTOR * transport.noise, posterior=_without_noise(posterior)
    )
    return Bars(ErrorBars(transport), ErrorBars(without_noise))


def _without_noise(posterior: AnyPosterior) -> AnyPosterior:
    if not isinstance(posterior, Posterior):
        return replace(posterior, variance_ratio=posterior.variance_ratio / NOISE_FACTOR**2)
    return replace(
        posterior,
        offset_noise=NOISE_FACTOR * posterior.offset_noise,
        light_noise=NOISE_FACTOR * posterior.light_noise,
    )


def mean_square(bars: ErrorBars, light: Floats, usable: Booleans) -> float:
    """Return the expected square of the error under a light, mean over usable camera pixels.

    Parameters
    ----------
    bars : ErrorBars
    light : ndarray, shape (Py, Px)
    usable : ndarray of bool, shape (C,)
    """
    squares = bars.mean_squares(light).reshape(len(usable), -1)[usable]
    return float(np.mean(squares, dtype=np.float64))
