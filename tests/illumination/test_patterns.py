"""8-bit patterns: the same however many rows are drawn together."""

from fractions import Fraction

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.illumination.frequencies import wrap
from nearfar.illumination.patterns import PIXELS_TOGETHER, cosine, draw_wave, quantise, sine


@pytest.mark.parametrize("size", [Size(70, 2000), Size(3, 40), Size(2, PIXELS_TOGETHER + 9)])
@pytest.mark.parametrize("wave", [cosine, sine])
def test_a_wave_is_drawn_a_few_rows_at_a_time(size, wave):
    frequency = wrap(Fraction(13, 70), Fraction(-7, 24))
    drawn = draw_wave(wave, frequency, size)
    assert drawn.shape == size
    np.testing.assert_array_equal(drawn, quantise(wave(frequency, size)))
    y, x = np.indices(size)
    cycles = 2 * np.pi * (13 / 70 * y - 7 / 24 * x)
    ideal = 0.5 + 0.5 * (np.cos(cycles) if wave is cosine else np.sin(cycles))
    assert np.abs(drawn / 255 - ideal).max() <= 0.5 / 255 + 1e-6
