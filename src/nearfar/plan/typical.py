"""What camera pixels to plan for: kinds, their strengths, and how many in each scene are so."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from nearfar.arrays import Floats
from nearfar.errors import InputError
from nearfar.transport.kinds import STRENGTHS, Kind

if TYPE_CHECKING:
    # A plan needs none of what a transport computes with.
    from nearfar.transport.model import Transport
    from nearfar.transport.posterior import Posterior

# Strengths of a kind in a scene that was looked at are put together in so many octaves.
OCTAVES = 2
# What makes up less than this of a scene is left out.
LEAST_SHARE = 5e-4


class Typical(NamedTuple):
    """Kinds of camera pixel in some scenes.

    Attributes
    ----------
    kinds : tuple of (Kind, float)
        With the strength, as a share of white.
    shares : ndarray, shape (scenes, kinds), float64
        How much of each scene's squared light is of each kind.
    weights : ndarray, shape (scenes,), float64
        How much a decibel of each scene counts.
    """

    kinds: tuple[tuple[Kind, float], ...]
    shares: Floats
    weights: Floats


def _scenes(weights: tuple[float, ...], *rows: tuple[Kind, float, tuple[float, ...]]) -> Typical:
    return Typical(
        tuple((kind, strength) for kind, strength, _ in rows),
        np.array([shares for *_, shares in rows]).T,
        np.array(weights),
    )


# Camera pixels of the box, the wedge and the corner together, and of the corner alone: its creases
# are few, but what they send from wall to wall decides how well pictures come out there.
TYPICAL = _scenes(
    (1.0, 0.1),
    (Kind(1.3, 256.0, 1.5), 0.0005, (0.22, 0.0)),
    (Kind(0.8, 256.0, 0.7), 0.0006, (0.18, 0.0)),
    (Kind(0.8, 256.0, 3.0), 0.0005, (0.1, 0.0)),
    (Kind(0.8, 64.0, 1.5), 0.0016, (0.1, 0.0)),
    (Kind(6.0, 256.0, 1.5), 0.0004, (0.1, 0.0)),
    (Kind(6.0, 64.0, 3.0), 0.0016, (0.09, 0.0)),
    (Kind(6.0, 64.0, 8.0), 0.001, (0.05, 0.0)),
    (Kind(3.5, 16.0, 1.5), 0.005, (0.06, 0.0)),
    (Kind(1.3, 1.0, 3.0), 0.05, (0.05, 0.0)),
    (Kind(2.2, 16.0, 1.5, 3.0), 0.006, (0.05, 0.0)),
    (Kind(0.8, 1.0, 3.0), 0.069, (0.0, 0.004)),
    (Kind(0.8, 256.0, 0.7), 0.00062, (0.0, 0.191)),
    (Kind(1.3, 256.0, 1.5), 0.0016, (0.0, 0.055)),
    (Kind(1.3, 256.0, 1.5), 0.00049, (0.0, 0.345)),
    (Kind(0.8, 256.0, 0.7), 0.002, (0.0, 0.023)),
    (Kind(6.0, 256.0, 1.5), 0.0024, (0.0, 0.003)),
    (Kind(0.8, 256.0, 3.0), 0.00057, (0.0, 0.09)),
    (Kind(0.8, 256.0, 3.0), 0.0016, (0.0, 0.013)),
    (Kind(6.0, 64.0, 1.5), 0.0019, (0.0, 0.01)),
    (Kind(6.0, 256.0, 1.5), 0.00044, (0.0, 0.031)),
    (Kind(2.2, 16.0, 0.7, 3.0), 0.01, (0.0, 0.006)),
    (Kind(0.8, 64.0, 1.5), 0.0019, (0.0, 0.047)),
    (Kind(0.8, 64.0, 3.0), 0.00046, (0.0, 0.023)),
    (Kind(2.2, 16.0, 1.5), 0.0074, (0.0, 0.003)),
    (Kind(0.8, 64.0, 1.5), 0.00069, (0.0, 0.034)),
    (Kind(6.0, 64.0, 8.0), 0.0016, (0.0, 0.031)),
    (Kind(0.8, 64.0, 3.0), 0.0025, (0.0, 0.021)),
    (Kind(6.0, 64.0, 3.0), 0.0026, (0.0, 0.014)),
    (Kind(3.5, 16.0, 1.5), 0.0067, (0.0, 0.013)),
    (Kind(2.2, 16.0, 1.5, 3.0), 0.0096, (0.0, 0.009)),
    (Kind(6.0, 16.0, 3.0), 0.0023, (0.0, 0.004)),
)


def typical_of(transport: "Transport") -> Typical:
    """Return the kinds of camera pixel that a joint estimate found.

    Parameters
    ----------
    transport : Transport
        From a quick look at the scene: few photos, estimated jointly.

    Raises
    ------
    InputError
        If the transport was not estimated jointly.
    """
    posterior = _believed(transport)
    power = np.mean(posterior.white.astype(np.float64) ** 2, axis=-1).ravel()
    octave = np.rint(np.log2(posterior.strength.ravel() / STRENGTHS[0])).astype(np.int64)
    group = posterior.kind.ravel().astype(np.int64) * len(STRENGTHS) + octave // OCTAVES
    found, member = np.unique(group, return_inverse=True)
    shares = np.bincount(member, power)
    squared = np.bincount(member, power * posterior.strength.ravel().astype(np.float64) ** 2)
    kept = np.flatnonzero(shares >= LEAST_SHARE * shares.sum())
    kinds = tuple(
        (posterior.kinds[found[i] // len(STRENGTHS)], float(np.sqrt(squared[i] / shares[i])))
        for i in kept
    )
    return Typical(kinds, (shares[kept] / shares[kept].sum())[None], np.ones(1))


def noise_of(transport: "Transport") -> float:
    """Return the noise of an answer in a joint estimate, as a share of white, over all pixels."""
    posterior = _believed(transport)
    noise = transport.noise.astype(np.float64)
    return float(np.sqrt(np.mean(noise**2) / np.mean(posterior.white.astype(np.float64) ** 2)))


def _believed(transport: "Transport") -> "Posterior":
    if transport.posterior is None:
        raise InputError(
            "this transport tells no kinds of camera pixel: reconstruct the quick look by --method "
            "joint."
        )
    return transport.posterior
