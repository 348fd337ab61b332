"""Responses to frequencies in real arithmetic: cosines and sines on the pattern grid.

A camera pixel's response to exp(-j 2 pi k.p) is b_k = (response to cos) - j (response to sin). It
is kept as those two real numbers, or as the first alone where k is its own negative; k and -k
share them. They are also the coefficients of a row of F,
f(p) = (1/P) sum_k b_k exp(j 2 pi k.p).

Index convention: m runs over the real coefficients, cosine before sine for each k.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Complexes, Floats, Integers, Size, beside, namespace, product
from nearfar.illumination.frequencies import (
    Frequency,
    as_array,
    far_frequencies,
    representatives,
)

# Values of drawn patterns, (M, P), up to which they are kept; beyond, sums go an axis at a time.
MOST_HELD = 2**26


class _Layout(NamedTuple):
    """Coefficients of frequencies that are their own negatives, and of the others.

    Attributes
    ----------
    own : tuple of ndarray of int
        Coefficients of those that are their own negatives, and their frequencies.
    pairs : list
        Each run of frequencies with a cosine and a sine, and where its coefficients start and stop.
    """

    own: tuple[NDArray[np.int64], NDArray[np.int64]]
    pairs: list[tuple[slice, tuple[int, int]]]


@dataclass(frozen=True)
class RealBasis:
    """Cosines and sines of chosen frequencies on the pattern grid.

    Attributes
    ----------
    frequencies : tuple of Frequency
        One of each +-k.
    projector : Size
    """

    frequencies: tuple[Frequency, ...]
    projector: Size

    @cached_property
    def index(self) -> NDArray[np.int64]:
        """Frequency of each coefficient, shape (M,)."""
        return np.array(
            [i for i, k in enumerate(self.frequencies) for _ in range(self._parts(k))],
            dtype=np.int64,
        )

    @cached_property
    def cycles(self) -> NDArray[np.float64]:
        """(fy, fx) of each frequency in cycles per projector pixel, shape (K, 2)."""
        return as_array(self.frequencies)

    @cached_property
    def is_sine(self) -> NDArray[np.bool_]:
        """Whether each coefficient belongs to a sine, shape (M,)."""
        return np.array(
            [sine for k in self.frequencies for sine in (False, True)[: self._parts(k)]],
            dtype=bool,
        )

    @staticmethod
    def _parts(frequency: Frequency) -> int:
        return 1 if frequency.is_own_negative else 2

    @property
    def count(self) -> int:
        """Number of real coefficients M."""
        return len(self.index)

    def response_indices(self, frequencies: Sequence[Frequency]) -> NDArray[np.int64]:
        """Return the indices of the responses to `frequencies`, cosine before sine."""
        order = {k: i for i, k in enumerate(self.frequencies)}
        wanted = [order[k] for k in frequencies]
        found = [np.flatnonzero(self.index == i) for i in wanted]
        return np.concatenate(found) if found else np.empty(0, dtype=np.int64)

    @cached_property
    def weights(self) -> NDArray[np.float64]:
        """Weight of each coefficient in the inverse DFT: 1/P, or 2/P for a pair +-k, shape (M,)."""
        parts = np.array([self._parts(k) for k in self.frequencies], dtype=np.float64)
        return np.asarray(parts[self.index] / self.projector.pixels)

    @cached_property
    def patterns(self) -> NDArray[np.float32]:
        """cos(2 pi k.p) or sin(2 pi k.p), shape (M, P)."""
        return self.patterns_on(slice(0, self.projector.height))

    def patterns_on(self, lines: slice) -> NDArray[np.float32]:
        """Patterns on some rows of the pattern grid, shape (M, lines * Px)."""
        down, across = self._phases
        down = down[lines]
        drawn = np.empty((self.count, len(down), len(across)), dtype=np.float32)
        for m, (i, sine) in enumerate(zip(self.index, self.is_sine, strict=True)):
            wave = np.outer(down[:, i], across[:, i])
            drawn[m] = wave.imag if sine else wave.real
        return drawn.reshape(self.count, len(down) * len(across))

    def patterns_at(self, offsets: Floats | Integers) -> NDArray[np.float32]:
        """Cosines and sines at chosen offsets (O, 2) from the origin, shape (M, O)."""
        angle = 2 * np.pi * (self.cycles @ offsets.T)[self.index]
        patterns = np.where(self.is_sine[:, None], np.sin(angle), np.cos(angle))
        return patterns.astype(np.float32)

    def recentre(self, responses: Floats, centres: NDArray[np.int64]) -> Floats:
        """Shift the phases of responses so that offsets count from each camera pixel's centre.

        Parameters
        ----------
        responses : ndarray, shape (n, channels, M)
        centres : ndarray of int, shape (n, 2)
            Projector pixels (y, x).
        """
        return self._shift_phases(responses, centres, +1)

    def uncentre(self, responses: Floats, centres: NDArray[np.int64]) -> Floats:
        """Inverse of `recentre`."""
        return self._shift_phases(responses, centres, -1)

    def _shift_phases(self, responses: Floats, centres: NDArray[np.int64], sign: int) -> Floats:
        xp = namespace(responses)
        down, across = (beside(phases, responses) for phases in self.single_phases)
        phase = down[centres[:, 0]] * across[centres[:, 1]]
        real, imaginary = xp.real(phase)[:, None], xp.imag(phase)[:, None]
        shifted: Floats = xp.empty_like(responses)
        own, pairs = self._layout
        is_contiguous = (
            isinstance(responses, np.ndarray)
            and responses.dtype == np.float32
            and responses.strides[-1] == shifted.strides[-1] == responses.itemsize
        )
        # A frequency that is its own negative has no sine: its phase is 1 or -1.
        single, alone = (beside(indices, responses) for indices in own)
        shifted[..., single] = responses[..., single] * real[..., alone]
        for run, (start, stop) in pairs:
            if is_contiguous:
                # A cosine and its sine are a complex number: one pass instead of six.
                turned = phase[:, None, run].conj() if sign > 0 else phase[:, None, run]
                before, after = (
                    v[..., start:stop].view(np.complex64) for v in (responses, shifted)
                )
                np.multiply(before, turned, out=after)
                continue
            c = real[..., run]
            s = sign * imaginary[..., run]
            even, odd = responses[..., start:stop:2], responses[..., start + 1 : stop : 2]
            shifted[..., start:stop:2] = even * c + odd * s
            shifted[..., start + 1 : stop : 2] = odd * c - even * s
        return shifted

    @cached_property
    def _layout(self) -> _Layout:
        """Where the coefficients of each kind of frequency lie."""
        cosine = np.flatnonzero(~self.is_sine)
        own = np.diff(np.append(cosine, self.count)) == 1
        single, first = np.flatnonzero(own), np.flatnonzero(~own)
        # Runs of pairs side by side, so that slices are views and nothing is copied.
        runs = np.split(first, np.flatnonzero(np.diff(first) != 1) + 1) if len(first) else []
        return _Layout(
            (cosine[single], single),
            [
                (
                    slice(int(run[0]), int(run[-1]) + 1),
                    (int(cosine[run[0]]), int(cosine[run[-1]]) + 2),
                )
                for run in runs
            ],
        )

    @cached_property
    def _phases(self) -> tuple[Complexes, Complexes]:
        """exp(j 2 pi k y) and exp(j 2 pi k x) on the pattern grid, (Py, K) and (Px, K)."""
        down, across = (
            np.exp(2j * np.pi * (np.arange(side)[:, None] * cycles % 1.0))
            for side, cycles in zip(self.projector, self.cycles.T, strict=True)
        )
        return down, across

    @cached_property
    def single_phases(self) -> tuple[Complexes, Complexes]:
        """exp(j 2 pi k y) and exp(j 2 pi k x), (Py, K) and (Px, K), in single precision."""
        down, across = self._phases
        return down.astype(np.complex64), across.astype(np.complex64)

    def analyse(self, light: Floats) -> Floats:
        """Return weights times the light's overlap with each pattern: (..., P) to (..., M)."""
        dtype = np.result_type(light.dtype, np.float32)
        if self.count * self.projector.pixels > MOST_HELD:
            return np.asarray(self._overlaps_by_axes(light) * self.weights)
        overlaps = light.astype(dtype, copy=False) @ self.patterns.T.astype(dtype, copy=False)
        return np.asarray(overlaps * self.weights)

    def synthesise(self, coefficients: Floats) -> Floats:
        """Adjoint of `analyse`, and the rows of F: (..., M) to (..., P)."""
        dtype = np.result_type(coefficients.dtype, np.float32)
        weighted = coefficients * self.weights.astype(dtype)
        if self.count * self.projector.pixels > MOST_HELD:
            return self._sum_by_axes(weighted)
        return product(weighted, self.patterns.astype(dtype, copy=False))

    def _overlaps_by_axes(self, light: Floats) -> Floats:
        """Return the light's overlap with each pattern, (..., P) to (..., M), an axis at a time."""
        flat = light.reshape(-1, *self.projector)
        down, across = self.single_phases
        (columns, of_column) = np.unique(self.cycles[:, 1], return_inverse=True)
        first = np.unique(of_column, return_index=True)[1]
        found = np.empty((len(flat), self.count))
        for one, overlaps in zip(flat, found, strict=True):
            # By real products, of which a light needs half as many.
            waves = across[:, first]
            along = one.astype(np.float32, copy=False) @ np.concatenate(
                [waves.real, waves.imag], axis=1
            )
            summed = along[:, : len(columns)] + 1j * along[:, len(columns) :]
            total = np.einsum("yk,yk->k", down, summed[:, of_column])
            overlaps[:] = np.where(self.is_sine, total.imag[self.index], total.real[self.index])
        return found.reshape(*light.shape[:-1], self.count)

    def _sum_by_axes(self, weighted: Floats) -> Floats:
        """Return sums of patterns, (..., M) to (..., P), an axis at a time."""
        flat = weighted.reshape(-1, self.count)
        down, across = self.single_phases
        found = np.empty((len(flat), *self.projector), dtype=np.float32)
        for one, picture in zip(flat, found, strict=True):
            both = np.zeros(len(self.frequencies), dtype=np.complex64)
            np.add.at(both, self.index, np.where(self.is_sine, -1j * one, one).astype(np.complex64))
            of_down = down * both
            picture[:] = of_down.real @ across.real.T - of_down.imag @ across.imag.T
        return found.reshape(*weighted.shape[:-1], self.projector.pixels)


def real_basis(frequencies: Sequence[Frequency], projector: Size) -> RealBasis:
    """Return the basis of cosines and sines of frequencies, each of which stands for +-k."""
    return RealBasis(tuple(frequencies), projector)


def basis_of_every_frequency(projector: Size) -> RealBasis:
    """Return the basis of all frequencies of a projector's DFT, as many as it has pixels."""
    return real_basis(representatives(far_frequencies(projector, projector)), projector)
