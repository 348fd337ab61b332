"""Functions that near-range light about q is made of: hats, fine next to q, coarser outwards.

The coarsest hats stand on a W x W grid of a pitch of some projector pixels, about the rounded q.
Next to q, where near-range light is sharpest, eight more hats stand around q at each half of that
pitch down to a projector pixel, so that their number grows with the logarithm of the projector's
resolution. A pitch of one projector pixel is the paper's window of W x W single pixels.

Each hat has a sum of 1, so that its coefficient is light under white.

Index convention: w runs over functions, row by row those of the coarsest grid first; then the eight
of each finer pitch, row by row.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size


def window_offsets(window: int) -> NDArray[np.int64]:
    """Return the window's offsets (y, x) from the rounded q, shape (W^2, 2)."""
    side = np.arange(window) - window // 2
    y, x = np.meshgrid(side, side, indexing="ij")
    return np.stack([y.ravel(), x.ravel()], axis=1)


def reachable(window: int, projector: Size) -> NDArray[np.bool_]:
    """Return which offsets of a window lead from some projector pixel to another, shape (W^2,).

    On a projector of one row, those of the window's middle row alone.
    """
    found: NDArray[np.bool_] = np.all(np.abs(window_offsets(window)) < projector, axis=1)
    return found


# Offsets of the eight hats of a finer pitch, in units of it.
AROUND_Q = np.array([offset for offset in window_offsets(3).tolist() if offset != [0, 0]])


@dataclass(frozen=True)
class NearBasis:
    """Hats about the rounded q.

    Attributes
    ----------
    window : int
        W, hats along each side at the coarsest pitch.
    pitch : int
        Projector pixels between these; a power of two.
    """

    window: int
    pitch: int = 1

    @property
    def finer_pitches(self) -> tuple[int, ...]:
        """Pitches of the hats next to q, falling: half of the coarsest pitch, ... 1."""
        halvings = self.pitch.bit_length() - 1
        return tuple(self.pitch >> step for step in range(1, halvings + 1))

    @property
    def rising_pitches(self) -> tuple[int, ...]:
        """All pitches, rising from 1."""
        return (*reversed(self.finer_pitches), self.pitch)

    @cached_property
    def offsets(self) -> NDArray[np.int64]:
        """Offsets (y, x) of the hats' middles from the rounded q, projector pixels, (J, 2)."""
        levels = [window_offsets(self.window) * self.pitch]
        return np.concatenate([*levels, *(AROUND_Q * pitch for pitch in self.finer_pitches)])

    @cached_property
    def pitches(self) -> NDArray[np.int64]:
        """Pitch of each hat, projector pixels, shape (J,)."""
        finer = np.repeat(np.array(self.finer_pitches, dtype=np.int64), len(AROUND_Q))
        return np.concatenate([np.full(self.window**2, self.pitch), finer])

    @property
    def is_next_to_q(self) -> NDArray[np.bool_]:
        """Whether each hat makes up for what an error of q takes from direct light, shape (J,).

        The hat at q and those of finer pitches do; of single pixels, the 3 x 3 about q.
        """
        reach = max(1, self.pitch // 2)
        return np.asarray(np.abs(self.offsets).max(axis=1) <= reach)

    @property
    def count(self) -> int:
        """Number of functions J."""
        return self.window**2 + len(AROUND_Q) * len(self.finer_pitches)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of a camera pixel's coefficients: (W, W) of single pixels, else (J,)."""
        return (self.window, self.window) if self.pitch == 1 else (self.count,)

    @property
    def reach(self) -> int:
        """Projector pixels from the rounded q to the farthest that a hat touches, along an axis."""
        return self.pitch * (self.window // 2) + self.pitch - 1

    def values_at(self, offsets: NDArray[np.int64]) -> Floats:
        """Return the functions at offsets (O, 2) from the rounded q, shape (O, J), float64."""
        apart = np.abs(offsets[:, None] - self.offsets)
        hats = np.maximum(0.0, 1.0 - apart / self.pitches[:, None])
        return np.asarray(np.prod(hats / self.pitches[:, None], axis=-1))

    def drawn(self, coefficients: Floats) -> Floats:
        """Return sums of the functions, (n, J), over the pixels up to `reach` about q, (n, R, R).

        The same as products with `values_at`, by the hats of each axis.
        """
        coarse = coefficients[:, : self.window**2].reshape(-1, self.window, self.window)
        hats = self._hats(np.arange(self.window) - self.window // 2, self.pitch)
        found = hats @ coarse @ hats.T
        first = self.window**2
        for pitch in self.finer_pitches:
            around = np.zeros((len(coefficients), 9), dtype=coefficients.dtype)
            around[:, np.arange(9) != 4] = coefficients[:, first : first + len(AROUND_Q)]
            hats = self._hats(np.arange(-1, 2), pitch)
            touched = np.flatnonzero(hats.any(axis=1))
            some = slice(touched[0], touched[-1] + 1)
            found[:, some, some] += hats[some] @ around.reshape(-1, 3, 3) @ hats[some].T
            first += len(AROUND_Q)
        return np.asarray(found)

    def _hats(self, places: NDArray[np.int64], pitch: int) -> Floats:
        """Return hats at places, in pitches, over the pixels along an axis, (R, places)."""
        pixels = np.arange(-self.reach, self.reach + 1)
        apart = np.abs(pixels[:, None] - places * pitch)
        return np.asarray(np.maximum(0.0, 1.0 - apart / pitch) / pitch)

    @cached_property
    def from_densities(self) -> Floats:
        """Coefficients from light per cell of the coarsest pitch at the hats' middles, (J, J).

        A finer hat holds what differs, at its middle, from the interpolation of the coarser ones,
        and as much light of it as its own area has.
        """
        place = {
            (pitch, *offset): w
            for w, (pitch, offset) in enumerate(
                zip(self.pitches.tolist(), map(tuple, self.offsets.tolist()), strict=True)
            )
        }
        found = np.eye(self.count)
        # The middle of a finer grid is that of the coarsest.
        place |= {(pitch, 0, 0): place[(self.pitch, 0, 0)] for pitch in self.finer_pitches}
        for pitch in self.finer_pitches:
            share = (pitch / self.pitch) ** 2
            for y, x in (AROUND_Q * pitch).tolist():
                w = place[(pitch, y, x)]
                # The corners of the coarser cell in which the hat stands; beyond the window is 0.
                corners = list(dict.fromkeys([(2 * y, 2 * x), (2 * y, 0), (0, 2 * x), (0, 0)]))
                found[w, w] = share
                for corner in corners:
                    if (coarser := place.get((2 * pitch, *corner))) is not None:
                        found[w, coarser] -= share / len(corners)
        return found


def basis_of(shape: tuple[int, ...], pitch: int) -> NearBasis:
    """Return the basis whose coefficients have a shape; see `NearBasis.shape`.

    Raises
    ------
    ValueError
        If no basis of that pitch has.
    """
    if pitch < 1 or pitch & (pitch - 1):
        raise ValueError(f"a pitch of {pitch} is no power of two")
    none_finer = math.prod(shape) - NearBasis(0, pitch).count
    basis = NearBasis(math.isqrt(max(none_finer, 0)), pitch)
    if basis.shape != shape:
        raise ValueError(f"no functions of a pitch of {pitch} have coefficients of shape {shape}")
    return basis


def hat_response(cycles: Floats, pitches: NDArray[np.int64]) -> Floats:
    """Return the response of hats with a sum of 1 to exp(-j 2 pi k.p) about their middles.

    Parameters
    ----------
    cycles : ndarray, shape (K, 2)
        k, in cycles per projector pixel.
    pitches : ndarray of int, shape (J,)

    Returns
    -------
    ndarray, shape (K, J), float64
        Real, as hats are even.
    """
    found = np.ones((len(cycles), len(pitches)))
    for pitch in np.unique(pitches[pitches > 1]).tolist():
        mine = pitches == pitch
        half = np.pi * cycles
        box = np.ones_like(half)
        np.divide(np.sin(half * pitch), pitch * np.sin(half), out=box, where=np.sin(half) != 0)
        found[:, mine] = np.prod(box**2, axis=1)[:, None]
    return found
