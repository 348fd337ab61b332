"""The full DFT of equation (3): a cosine and a sine of every frequency, as inverse pairs.

A pair's difference is the answer to a sinusoid without offset, so ambient light and black levels
fall out. Equation (3), t(p) = 1/P sum_k b_k l_k*(p), is an inverse DFT.

Patterns of 8 bits stray from sinusoids by up to 1/255, which by equation (3) alone leaves an error
of about 0.3 % of a row, 50 dB. What is shown is known, so each refinement takes what the estimate
would have answered to it from the responses, and the inverse DFT of the rest corrects the estimate;
one brings the error to about 100 dB, for one product with a P x P matrix.

Index convention: r runs over the P real responses, cosine before sine for each of +-k; i over rows.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from nearfar.arrays import Floats, Integers, Size, blocks
from nearfar.illumination.frequencies import grid, representatives
from nearfar.illumination.patterns import cosine, invert, quantise, sine
from nearfar.illumination.real_basis import RealBasis, real_basis

# Patterns drawn at once while refining.
DRAWN = 32


@dataclass(frozen=True)
class FullDFT:
    """Every DFT frequency as a cosine and a sine and their inverses: 2 P photos.

    Under noise that does not grow with light, an entry of T has 4 / P of the variance of a photo.

    Attributes
    ----------
    projector : Size
    refinements : int
        Corrections for what 8 bits show instead of sinusoids; 0 is equation (3) alone.
    """

    projector: Size
    refinements: int = 1
    name: str = "full DFT"

    @property
    def photos(self) -> int:
        """Two for each of P real responses."""
        return 2 * self.projector.pixels

    @cached_property
    def basis(self) -> RealBasis:
        """Frequencies, one of each +-k, and their cosines and sines."""
        return real_basis(representatives(grid(self.projector, self.projector)), self.projector)

    @cached_property
    def _numbers(self) -> Integers:
        """Frequencies as whole numbers of cycles across the projector, (frequencies, 2)."""
        cycles = self.basis.cycles * np.array(self.projector)
        return np.asarray(np.rint(cycles).astype(np.int64))

    def _shown(self, r: int) -> NDArray[np.uint8]:
        draw = sine if self.basis.is_sine[r] else cosine
        return quantise(draw(self.basis.frequencies[self.basis.index[r]], self.projector))

    def patterns(self) -> Iterator[NDArray[np.uint8]]:
        """Draw each pattern, followed by its inverse."""
        for r in range(self.projector.pixels):
            shown = self._shown(r)
            yield shown
            yield invert(shown)

    def decode(self, photos: Floats) -> Floats:
        """Transform pair differences, and refine: (2 P, I) to (I, P)."""
        responses = (photos[0::2] - photos[1::2]).T.astype(np.float64)
        rows = self._transform(responses)
        for _ in range(self.refinements):
            rows += self._transform(responses - self._responses_of(rows))
        return rows

    def _transform(self, responses: Floats) -> Floats:
        """Equation (3): real responses (I, P) to rows (I, P)."""
        spectrum = np.zeros((len(responses), *self.projector), dtype=np.complex128)
        y, x = self._numbers[self.basis.index].T
        sines = self.basis.is_sine
        spectrum[:, y[~sines], x[~sines]] = responses[:, ~sines]
        spectrum[:, y[sines], x[sines]] -= 1j * responses[:, sines]
        # A real row responds to -k by the conjugate of its response to k.
        down, across = self._numbers.T
        spectrum[:, -down, -across] = spectrum[:, down, across].conj()
        return np.asarray(fft.ifft2(spectrum).real.reshape(responses.shape))

    def _responses_of(self, rows: Floats) -> Floats:
        """Responses of rows to what is shown: 2 l / 255 - 1."""
        height, width = self.projector
        period = int(np.lcm(height, width))
        y, x = np.divmod(np.arange(height * width), width)
        # Every pattern is a walk through one period of a sinusoid, in whole steps.
        angle = 2 * np.pi * np.arange(period) / period
        period_of = {
            False: quantise(0.5 + 0.5 * np.cos(angle)) * (2.0 / 255.0) - 1.0,
            True: quantise(0.5 + 0.5 * np.sin(angle)) * (2.0 / 255.0) - 1.0,
        }
        numbers = self._numbers[self.basis.index]
        responses = np.empty_like(rows)
        for is_sine, shown in period_of.items():
            mine = np.flatnonzero(self.basis.is_sine == is_sine)
            for block in blocks(len(mine), DRAWN):
                ky, kx = numbers[mine[block]].T[..., None]
                steps = (ky * y * (period // height) + kx * x * (period // width)) % period
                responses[:, mine[block]] = rows @ shown[steps].T
        return responses
