"""Patterns: sinusoids with offset, stripes, Gray code, and their 8-bit form.

A pattern is (Py, Px), values in [0, 1], 1 = full white.
"""

import math
from collections.abc import Callable
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Size, blocks
from nearfar.illumination.frequencies import Frequency

Wave = Callable[[Frequency, Size, slice], NDArray[np.float64]]


# Rows of a pattern are drawn together up to as many pixels, which stay in the processor's cache.
PIXELS_TOGETHER = 2**16
ALL_ROWS = slice(None)


def phase(frequency: Frequency, size: Size, rows: slice = ALL_ROWS) -> NDArray[np.float64]:
    """Return k . p modulo one cycle at the projector pixels of some rows, in cycles, (rows, Px).

    Reduced in whole numbers, so that a pattern of a thousand pixels is as exact as its first.
    """

    def axis(cycles: Fraction, length: int) -> NDArray[np.float64]:
        steps = (np.arange(length, dtype=np.int64) * cycles.numerator) % cycles.denominator
        return np.asarray(steps / cycles.denominator)

    down, across = axis(frequency.fy, size.height), axis(frequency.fx, size.width)
    return np.asarray((down[rows, None] + across) % 1.0)


def cosine(frequency: Frequency, size: Size, rows: slice = ALL_ROWS) -> NDArray[np.float64]:
    """0.5 + 0.5 cos(2 pi k.p) (section 5.1)."""
    return np.asarray(0.5 + 0.5 * np.cos(2 * np.pi * phase(frequency, size, rows)))


def sine(frequency: Frequency, size: Size, rows: slice = ALL_ROWS) -> NDArray[np.float64]:
    """0.5 + 0.5 sin(2 pi k.p) (section 5.1)."""
    return np.asarray(0.5 + 0.5 * np.sin(2 * np.pi * phase(frequency, size, rows)))


def draw_wave(wave: Wave, frequency: Frequency, size: Size) -> NDArray[np.uint8]:
    """Draw the 8-bit pattern of `cosine` or `sine`, a few rows at a time, shape (Py, Px)."""
    drawn = np.empty(size, dtype=np.uint8)
    for rows in blocks(size.height, PIXELS_TOGETHER // size.width):
        drawn[rows] = quantise(wave(frequency, size, rows))
    return drawn


def exponential(frequency: Frequency, size: Size) -> NDArray[np.complex128]:
    """exp(-j 2 pi k.p), the DFT basis of equation (2), which no projector can show."""
    return np.asarray(np.exp(-2j * np.pi * phase(frequency, size)))


def black_row(index: int, size: Size) -> NDArray[np.float64]:
    """White with row `index` black."""
    pattern = np.ones(size)
    pattern[index, :] = 0.0
    return pattern


def black_column(index: int, size: Size) -> NDArray[np.float64]:
    """White with column `index` black."""
    pattern = np.ones(size)
    pattern[:, index] = 0.0
    return pattern


def left_half(size: Size) -> NDArray[np.float64]:
    """White on the left half of the columns; the middle one of an odd number is black."""
    pattern = np.zeros(size)
    pattern[:, : size.width // 2] = 1.0
    return pattern


def top_half(size: Size) -> NDArray[np.float64]:
    """White on the upper half of the rows; the middle one of an odd number is black."""
    pattern = np.zeros(size)
    pattern[: size.height // 2] = 1.0
    return pattern


def gray_bits(length: int) -> int:
    """Return the number of bits of Gray code for a number of rows or columns."""
    return (length - 1).bit_length()


def gray_rows(bit: int, size: Size) -> NDArray[np.float64]:
    """White where bit `bit`, 0 the finest, of the row's Gray code is 1 (Gray 1953)."""
    return np.repeat(_gray(bit, size.height)[:, None], size.width, axis=1)


def gray_columns(bit: int, size: Size) -> NDArray[np.float64]:
    """White where bit `bit`, 0 the finest, of the column's Gray code is 1."""
    return np.repeat(_gray(bit, size.width)[None, :], size.height, axis=0)


def _gray(bit: int, length: int) -> NDArray[np.float64]:
    index = np.arange(length)
    return (((index ^ (index >> 1)) >> bit) & 1).astype(np.float64)


def quantise(pattern: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Round values in [0, 1] to 8 bits."""
    return np.rint(255.0 * pattern).astype(np.uint8)


def invert(pattern: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return 255 less the 8-bit pattern, so that a pair sums exactly to white."""
    return np.asarray(255 - pattern, dtype=np.uint8)


def is_prime(number: int) -> bool:
    """Return whether a whole number is prime."""
    return number > 1 and all(number % factor for factor in range(2, math.isqrt(number) + 1))


def s_matrix_row(order: int, row: int, size: Size) -> NDArray[np.float64]:
    """Draw a row of the cyclic S-matrix of a prime order 4 m + 3 over the pixels, (Py, Px).

    The order + 1 patterns of all rows and black tell as many pixels as the order apart, each with a
    variance of about 4 / order of that of a photo (Harwit and Sloane 1979).
    """
    squares = np.zeros(order, dtype=bool)
    squares[np.arange(order) ** 2 % order] = True
    return squares[(row + np.arange(size.pixels)) % order].reshape(size).astype(np.float64)
