"""Responses of camera pixels to waves, with the phase of a place taken out.

What was measured is responses to waves, so they are what an estimate knows best of a row. Far-range
light tells in the slow ones, light under a surface in all of them, and direct light alike in every
one.

Index convention: c runs over chosen camera pixels, r over real responses: the cosines of all waves,
then the sines of those that have one.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Complexes, Floats, Integers, blocks
from nearfar.illumination.frequencies import as_array
from nearfar.transport.factors import Factors
from nearfar.transport.model import Transport
from nearfar.transport.posterior import Posterior

# Waves that a transport is asked for where nothing says which were measured.
SPREAD_WAVES = 96
# The plastic number: multiples of its inverse and of that of its square fill a square evenly
# (Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018).
PLASTIC = 1.32471795724474602596
# Waves that light a transport at a time, and their values on projector pixels at most, but for one.
WAVES_AT_ONCE = 16
VALUES_AT_ONCE = 2**22


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
    def of_responses(self) -> Floats:
        """Cycles per projector pixel of each real response, shape (R, 2)."""
        return np.concatenate([self.cycles, self.cycles[self.has_sine]])

    def at(self, places: Integers) -> Complexes:
        """Return exp(j 2 pi k.p) at places p (..., 2), shape (..., K)."""
        return np.asarray(np.exp(2j * np.pi * (places @ self.cycles.T)))

    def real(self, values: Complexes) -> Floats:
        """Return complex responses (..., K) as real ones, (..., R)."""
        return np.concatenate([values.real, values.imag[..., self.has_sine]], axis=-1)


class Responses(NamedTuple):
    """Responses with the phase of a place taken out.

    Attributes
    ----------
    to_direct : ndarray, shape (n, K), complex
        Of unit direct light.
    total : ndarray, shape (n, channels, R)
        Of rows.
    """

    to_direct: Complexes
    total: Floats

    def of(self, chosen: Integers) -> "Responses":
        """Return those of some camera pixels."""
        return Responses(self.to_direct[chosen], self.total[chosen])


def waves_of(transport: Transport) -> Waves:
    """Return the waves that a transport was measured by, DC excluded.

    Where it does not say what was measured, waves are spread over all frequencies.
    """
    if isinstance(transport.posterior, Posterior):
        measured = transport.posterior.frequencies
        return Waves(as_array(measured), np.array([not k.is_own_negative for k in measured]))
    steps = np.arange(1, SPREAD_WAVES + 1)[:, None]
    cycles = (steps / np.array([PLASTIC, PLASTIC**2])) % 1 - 0.5
    # One of each +-k.
    cycles[:, 0] = np.abs(cycles[:, 0])
    return Waves(cycles, np.ones(SPREAD_WAVES, dtype=bool))


def unit_direct(factors: Factors) -> Factors:
    """Return factors of the same footprints with direct light of 1 in one channel, and no other."""
    pixels = len(factors.q)
    return replace(
        factors,
        second=None,
        direct=np.ones((pixels, 1), dtype=np.float32),
        near=np.zeros((pixels, 1, factors.near.shape[2]), dtype=np.float32),
        far=np.zeros((pixels, 1, factors.far.shape[2]), dtype=np.float32),
    )


def responses(
    transport: Transport, pixels: Integers, places: Integers, waves: Waves, boxes: Floats
) -> Responses:
    """Return responses of chosen camera pixels.

    Parameters
    ----------
    transport : Transport
    pixels : ndarray of int, shape (n,)
    places : ndarray of int, shape (n, 2)
        Projector pixels whose phase is taken out of them.
    waves : Waves
    boxes : ndarray, shape (n, 4)
        Footprints of unit direct light, as `Transport.boxes` has them.

    Returns
    -------
    Responses
    """
    whole = transport.factors
    total = replace(
        whole,
        q=whole.q[pixels],
        direct=whole.direct[pixels],
        near=whole.near[pixels],
        far=whole.far[pixels],
        boxes=whole.boxes[pixels],
        second=None,
    )
    unit = replace(unit_direct(total), boxes=boxes)
    height, width = transport.projector
    down, across = (
        np.exp(2j * np.pi * np.outer(along, np.arange(side)))
        for along, side in zip(waves.cycles.T, (height, width), strict=True)
    )
    to_direct = np.empty((len(pixels), len(waves.cycles)), dtype=np.complex128)
    of_rows = np.empty((len(pixels), transport.channels, len(waves.cycles)), dtype=np.complex128)
    at_once = max(1, min(WAVES_AT_ONCE, VALUES_AT_ONCE // (height * width)))
    for block in blocks(len(waves.cycles), at_once):
        drawn = down[block, :, None] * across[block, None, :]
        parts = np.concatenate([drawn.real, drawn.imag]).reshape(-1, 1, height * width)
        lights = parts.astype(np.float32)
        half = len(lights) // 2
        direct = unit.pictures(lights).direct[..., 0]
        of_direct, of_near, of_far = total.pictures(lights)
        rows = of_direct + of_near + of_far
        to_direct[:, block] = (direct[:half] + 1j * direct[half:]).T
        of_rows[..., block] = np.moveaxis(rows[:half] + 1j * rows[half:], 0, -1)
    turned = np.exp(-2j * np.pi * (places @ waves.cycles.T))
    return Responses(to_direct * turned, waves.real(of_rows * turned[:, None]))
