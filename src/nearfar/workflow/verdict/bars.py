"""Error bars of a transport whose relit pictures are compared with photos."""

from collections.abc import Sequence
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


def mean_squares(bars: ErrorBars, lights: Sequence[Floats], usable: Booleans) -> list[float]:
    """Return the expected square of the error under each light, mean over usable camera pixels.

    Parameters
    ----------
    bars : ErrorBars
    lights : sequence of ndarray, shape (Py, Px)
    usable : ndarray of bool, shape (C,)
    """
    squares = bars.mean_squares_under(lights)
    return [
        float(np.mean(one.reshape(len(usable), -1)[usable], dtype=np.float64)) for one in squares
    ]


def expected_and_unmeasured(
    bars: Bars | None, lights: Sequence[Floats], usable: Booleans
) -> list[tuple[float, float]] | list[tuple[None, None]]:
    """Return these of photos with their noise, and with hardly any, under each light.

    Parameters
    ----------
    bars : Bars, optional
        None is returned in their place where there are none.
    lights, usable
        As `mean_squares` takes them.
    """
    if bars is None:
        return [(None, None)] * len(lights)
    return list(zip(*(mean_squares(each, lights, usable) for each in bars), strict=True))
