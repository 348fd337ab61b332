"""Footprints of direct light on a large projector: Gaussian, of widths that are tried in turn.

A camera pixel may see less than a projector pixel, or many. A footprint of width s keeps
A(k) = exp(-2 pi^2 s^2 |k|^2) of the response to frequency k. The place q that fits best maximises
the matched filter sum_k A(k) w_k Re(b_k exp(j 2 pi k.q)), and the width is the one whose filter
stands out most in units of its own deviation, sqrt(sum_k A(k)^2 w_k). So frequencies that are too
high for a footprint have no say in its place.

Index convention: n runs over camera pixels, b over weighings, r over real responses, k over
frequencies, s over widths, o over offsets.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Integers, Size
from nearfar.correspondence.weighing import Weighed
from nearfar.illumination.real_basis import RealBasis

# Narrowest footprint in projector pixels. Narrower ones fall on one or two pixels, and respond to
# the highest frequencies as those pixels do, not as their centroid does: so these count for less.
NARROWEST = 0.8
# Widest footprint, as a share of the projector's longer side. Near-range light reaches further.
WIDEST = 0.008
# Each width over the one before.
WIDTH_STEP = 1.7
# Newton's method starts at the best of this many offsets on each axis, so many of the shortest
# period apart, or half a projector pixel where that is more.
STARTS = 5
STARTS_PER_PERIOD = 8.0
LEAST_SPACING = 0.5
NEWTON_STEPS = 3


def widths(projector: Size) -> Floats:
    """Return the standard deviations of footprints, in projector pixels, shape (S,)."""
    widest = max(WIDEST * max(projector), NARROWEST)
    count = int(np.ceil(np.log(widest / NARROWEST) / np.log(WIDTH_STEP))) + 1
    return np.asarray(NARROWEST * WIDTH_STEP ** np.arange(count))


def kept(basis: RealBasis, deviations: Floats) -> Floats:
    """Return the response to each frequency that footprints keep, (K, S)."""
    squared = (basis.cycles**2).sum(axis=1)
    return np.asarray(np.exp(-2 * np.pi**2 * np.outer(squared, deviations**2)), dtype=np.float32)


def filters(basis: RealBasis, offsets: Floats | Integers, kept_shares: Floats) -> Floats:
    """Return the matched filters of footprints of each width at each offset, (R, S * O)."""
    waves = basis.patterns_at(offsets)[:, None] * kept_shares[basis.index][..., None]
    return waves.reshape(basis.count, -1)


class Placed(NamedTuple):
    """Where footprints fit best.

    Attributes
    ----------
    q : ndarray, shape (n, 2), float32
        In projector pixels.
    scores : ndarray, shape (n, B), float32
        The highest matched filter at q in units of its deviation, for each of B weighings.
    """

    q: Floats
    scores: Floats


class Footprints:
    """Places footprints to a fraction of a pixel.

    Parameters
    ----------
    basis : RealBasis
        Measured frequencies, without DC.
    """

    def __init__(self, basis: RealBasis) -> None:
        self.basis = basis
        self.kept = kept(basis, widths(basis.projector))
        self._radians = (2 * np.pi * basis.cycles).astype(np.float32)
        highest = np.abs(basis.cycles).max(axis=0)
        periods = 1.0 / np.maximum(highest, 1.0 / np.array(basis.projector))
        self._spacing = np.maximum(periods / STARTS_PER_PERIOD, LEAST_SPACING).astype(np.float32)
        numbers = np.arange(STARTS, dtype=np.float32) - STARTS // 2
        starts = np.stack(np.meshgrid(numbers, numbers, indexing="ij"), axis=-1)
        self._starts = starts.reshape(-1, 2) * self._spacing
        self._filters = filters(basis, self._starts, self.kept)

    def place(
        self, weighed: Weighed, others: Sequence[Weighed], around: NDArray[np.int64]
    ) -> Placed:
        """Find the best place within a quarter of the shortest period of others.

        Parameters
        ----------
        weighed : Weighed
            Responses of n camera pixels, by which they are placed.
        others : sequence of Weighed
            The same responses, weighed otherwise, whose scores are returned.
        around : ndarray of int, shape (n, 2)
            Projector pixels.
        """
        together = np.stack([each.responses for each in (weighed, *others)], axis=1)
        turned = self.basis.recentre(together, around)
        deviations = np.sqrt(weighed.weights @ self.kept**2)
        scores = (turned[:, 0] @ self._filters).reshape(len(around), -1, len(self._starts))
        scores /= deviations[..., None]
        best = scores.reshape(len(around), -1).argmax(axis=1)
        width, start = np.divmod(best, len(self._starts))
        cosine, sine = self._parts(turned)
        shares = self.kept.T[width]
        offset = self._climb(cosine[:, 0] * shares, sine[:, 0] * shares, self._starts[start])
        limit = np.array(self.basis.projector, dtype=np.float32) - 1
        q = np.clip(around + offset, 0, limit).astype(np.float32)
        angle = (q - around).astype(np.float32) @ self._radians.T
        c, s = np.cos(angle), np.sin(angle)
        found = [
            self._score(cosine[:, b] * c + sine[:, b] * s, other.weights)
            for b, other in enumerate(others, start=1)
        ]
        return Placed(q, np.stack(found, axis=1))

    def _score(self, along: Floats, weights: Floats) -> Floats:
        """Return the score of the width that stands out most, (n,), from responses along q."""
        scores: Floats = (along @ self.kept) / np.sqrt(weights @ self.kept**2)
        return np.asarray(scores.max(axis=1))

    def _climb(self, cosine: Floats, sine: Floats, offset: Floats) -> Floats:
        """Go to the maximum beside each offset by Newton's method, (n, 2)."""
        down, across = self._radians.T
        products = np.stack([down * down, down * across, across * across], axis=1)
        for _ in range(NEWTON_STEPS):
            angle = offset @ self._radians.T
            c, s = np.cos(angle), np.sin(angle)
            y, x = ((sine * c - cosine * s) @ self._radians).T
            yy, yx, xx = ((cosine * c + sine * s) @ products).T
            determinant = yy * xx - yx * yx
            # Elsewhere the filter has no maximum near by.
            convex = (determinant > 0) & (yy > 0)
            step = np.stack([xx * y - yx * x, yy * x - yx * y], axis=1)
            step /= np.where(convex, determinant, 1.0)[:, None]
            offset = offset + np.clip(step, -self._spacing, self._spacing) * convex[:, None]
        return offset

    def _parts(self, turned: Floats) -> tuple[Floats, Floats]:
        """Return the responses to cosines and to sines, (n, B, K); 0 where there is no sine."""
        first = np.flatnonzero(~self.basis.is_sine)
        paired = np.diff(np.append(first, self.basis.count)) == 2
        cosine, sine = turned[..., first], np.zeros((*turned.shape[:2], len(first)), turned.dtype)
        sine[..., paired] = turned[..., first[paired] + 1]
        return cosine, sine
