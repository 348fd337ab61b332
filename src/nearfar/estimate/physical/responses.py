"""Responses of camera pixels to waves, with the phase at q taken out.

What was measured is responses to waves, so they are what an estimate knows best of a row. Far-range
light tells in the slow ones, light under a surface in all of them, and direct light alike in every
one.

Index convention: c runs over chosen camera pixels, r over real responses: the cosines of all waves,
then the sines of those that have one.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, blocks
from nearfar.illumination.frequencies import as_array
from nearfar.transport.model import Transport
from nearfar.transport.near import centre
from nearfar.transport.posterior import Posterior

# Waves that a transport is asked for where nothing says which were measured.
SPREAD_WAVES = 96
# The plastic number and its square: multiples of their inverses fill a square evenly
# (Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018).
PLASTIC = 1.32471795724474602596
# Numbers of a block of dense rows.
BLOCK_NUMBERS = 1 << 25


class Waves(NamedTuple):
    """Waves over the projector.

    Attributes
    ----------
    cycles : ndarray, shape (K, 2)
        Cycles per projector pixel down and across.
    has_sine : ndarray of bool, shape (K,)
        Whether the sine differs from 0 on whole pixels.
    """

    cycles: Floats
    has_sine: Booleans

    @property
    def frequency(self) -> Floats:
        """Cycles per projector pixel of each real response, shape (R,)."""
        lengths = np.hypot(*self.cycles.T)
        return np.concatenate([lengths, lengths[self.has_sine]])

    def at(self, offsets: Integers) -> Floats:
        """Return the waves at offsets (..., 2), shape (..., R)."""
        phase = 2 * np.pi * (offsets @ self.cycles.T)
        return np.concatenate([np.cos(phase), np.sin(phase[..., self.has_sine])], axis=-1)


def waves_of(transport: Transport) -> Waves:
    """Return the waves that a transport was measured by, DC excluded.

    Where it does not tell, they are spread over all frequencies.
    """
    if isinstance(transport.posterior, Posterior):
        measured = transport.posterior.frequencies
        return Waves(as_array(measured), np.array([not k.is_own_negative for k in measured]))
    steps = np.arange(1, SPREAD_WAVES + 1)[:, None]
    cycles = (steps / np.array([PLASTIC, PLASTIC**2])) % 1 - 0.5
    # One of each +-k.
    cycles[:, 0] = np.abs(cycles[:, 0])
    return Waves(cycles, np.ones(SPREAD_WAVES, dtype=bool))


def responses_about_q(transport: Transport, pixels: Integers, waves: Waves) -> Floats:
    """Return responses with the phase at the rounded q taken out.

    Parameters
    ----------
    transport : Transport
    pixels : ndarray of int, shape (n,)
        Camera pixels with direct light, rising.
    waves : Waves

    Returns
    -------
    ndarray, shape (n, channels, R), float64
        The sum of a row times `Waves.at` the offset from q.
    """
    projector = transport.projector
    centres = centre(transport.correspondence, projector)[pixels]
    y, x = np.divmod(np.arange(projector.pixels), projector.width)
    phase = 2 * np.pi * (np.stack([y, x], axis=-1) @ waves.cycles.T)
    exponentials = np.exp(1j * phase)
    length = len(waves.frequency)
    found = np.empty((len(pixels), transport.channels, length))
    at_once = max(1, BLOCK_NUMBERS // (transport.channels * projector.pixels))
    for block in blocks(transport.camera.pixels, at_once):
        here = np.flatnonzero((pixels >= block.start) & (pixels < block.stop))
        if not len(here):
            continue
        first, last = int(pixels[here[0]]), int(pixels[here[-1]])
        rows = transport.rows(slice(first, last + 1))[pixels[here] - first]
        turned = np.exp(-2j * np.pi * (centres[here] @ waves.cycles.T))
        values = (rows @ exponentials) * turned[:, None]
        sines = values.imag[..., waves.has_sine]
        found[here] = np.concatenate([values.real, sines], axis=-1)
    return found
