"""The frequencies that the method measures: exact rationals in cycles per projector pixel.

A frequency is a pair (fy, fx). Patterns live on whole pixels, so frequencies that differ by a
whole number of cycles per pixel are one and the same; each is kept in [-1/2, 1/2). A real
transport responds to -k by the complex conjugate of its response to k, so +-k share their
photos and stand under one representative.
"""

from collections.abc import Iterable
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Size

HALF = Fraction(1, 2)
# With a larger one, products with a pixel's number would not be exact in 64 bits.
LARGEST_DENOMINATOR = 2**40
# Longer text is no such fraction, and may take minutes to read.
MAXIMUM_TEXT = 40


class Frequency(NamedTuple):
    """Cycles per projector pixel down and across."""

    fy: Fraction
    fx: Fraction

    def __neg__(self) -> "Frequency":
        return wrap(-self.fy, -self.fx)

    @property
    def is_own_negative(self) -> bool:
        """Whether k and -k are the same: DC, the checkerboard, (0, 1/2) and (1/2, 0)."""
        return all(part.denominator <= 2 for part in self)


def wrap(fy: Fraction, fx: Fraction) -> Frequency:
    """Bring a frequency into [-1/2, 1/2) on both axes."""
    return Frequency(_wrap(fy), _wrap(fx))


def _wrap(part: Fraction) -> Fraction:
    # Most frequencies are in there already, and arithmetic with fractions is slow.
    if -part.denominator <= 2 * part.numerator < part.denominator:
        return part
    return (part + HALF) % 1 - HALF


DC = Frequency(Fraction(0), Fraction(0))
CHECKERBOARD = wrap(Fraction(1, 2), Fraction(1, 2))


def is_on_grid(frequency: Frequency, projector: Size) -> bool:
    """Return whether a frequency is a whole number of cycles per pattern grid."""
    return all(
        (part * side).denominator == 1 for part, side in zip(frequency, projector, strict=True)
    )


def frequency_from_text(parts: Iterable[str]) -> Frequency:
    """Read a frequency written as two fractions, such as ``["-1/19", "0"]``.

    Raises
    ------
    ValueError
        If the parts are not two fractions in [-1/2, 1/2), or of larger whole numbers than
        `LARGEST_DENOMINATOR`.
    """
    try:
        fy, fx = (_fraction(part) for part in parts)
    except (TypeError, ZeroDivisionError, OverflowError) as error:
        raise ValueError(f"{parts!r} is no frequency: {error}") from None
    if max(fy.denominator, fx.denominator) > LARGEST_DENOMINATOR:
        raise ValueError(f"a frequency is a fraction of whole numbers up to {LARGEST_DENOMINATOR}")
    if wrap(fy, fx) != (fy, fx):
        raise ValueError("a frequency lies in [-1/2, 1/2) cycles per pixel on both axes")
    return Frequency(fy, fx)


def _fraction(part: str | Fraction) -> Fraction:
    # An exponent may stand for a number of any length.
    if isinstance(part, str) and (len(part) > MAXIMUM_TEXT or "e" in part.lower()):
        raise ValueError("a frequency is two fractions, such as -1/19 and 0")
    return Fraction(part)


def frequency_to_text(frequency: Frequency) -> list[str]:
    """Write a frequency as two fractions; see `frequency_from_text`."""
    return [str(frequency.fy), str(frequency.fx)]


def representative(frequency: Frequency) -> Frequency:
    """Return the later of k and -k in order, which stands for both."""
    return max(frequency, -frequency)


def band(count: int) -> range:
    """Whole frequencies of a DFT of `count` points: -N/2 ... N/2 - 1, or -(N-1)/2 ... (N-1)/2."""
    return range(-(count // 2), count - count // 2)


def grid(size: Size, period: Size) -> list[Frequency]:
    """Frequencies of a `size` band at multiples of one cycle per `period` pixels."""
    return [
        wrap(Fraction(y, period.height), Fraction(x, period.width))
        for y in band(size.height)
        for x in band(size.width)
    ]


def far_frequencies(far: Size, projector: Size) -> list[Frequency]:
    """List the low DFT frequencies k/P of the far band, |K_far| of them (section 4.3)."""
    return grid(far, projector)


def near_frequencies(window: int, dropped: Size) -> list[Frequency]:
    """List the uniform near set j/W less its lowest frequencies (section 4.2).

    The checkerboard, which an even W holds, is left out: it is the direct measurement.

    Parameters
    ----------
    window : int
        W.
    dropped : Size
        Odd height and width of the block of lowest frequencies to leave out.

    Returns
    -------
    list of Frequency
        W^2 less the dropped, less the checkerboard for even W.
    """
    square = Size(window, window)
    low = set(grid(dropped, square))
    return [k for k in grid(square, square) if k not in low and k != CHECKERBOARD]


def default_dropped(window: int, far: Size, projector: Size) -> Size:
    """Return the block of near frequencies with |k| <= k_far: at least DC (section 4.2)."""

    def side(far_side: int, projector_side: int) -> int:
        highest = int(window * Fraction(far_side // 2, projector_side))
        return min(2 * highest + 1, window - 1 + window % 2)

    return Size(side(far.height, projector.height), side(far.width, projector.width))


def representatives(frequencies: Iterable[Frequency]) -> list[Frequency]:
    """Return one of each +-k, in the order of first appearance."""
    return list(dict.fromkeys(representative(k) for k in frequencies))


def as_array(frequencies: Iterable[Frequency]) -> NDArray[np.float64]:
    """Return frequencies as an array, shape (K, 2), in cycles per pixel."""
    return np.array([[float(k.fy), float(k.fx)] for k in frequencies]).reshape(-1, 2)
