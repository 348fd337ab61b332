"""Ratios in words: numbers where float32 tells them, and no noise of the arithmetic."""

import numpy as np
import pytest

import nearfar
from nearfar.decibels import EXACT, in_figures, in_words


@pytest.mark.parametrize(("decibels", "words"), [(41.23, "41.2 dB"), (-3.0, "-3.0 dB")])
def test_what_float32_tells_is_a_number(decibels, words):
    assert in_words(decibels) == words
    assert f"{in_figures(decibels)} dB" == words


@pytest.mark.parametrize("terms", [1, 100, 100_000])
def test_sums_in_float32_are_exact_to_rounding(terms):
    drawn = np.random.default_rng(terms).random((50, terms), dtype=np.float32)
    exact = drawn.sum(axis=1, dtype=np.float64)
    assert in_words(nearfar.snr(exact, drawn.sum(axis=1))) == EXACT


def test_photos_of_16_bits_are_not():
    picture = np.random.default_rng(0).random(1000)
    assert in_words(nearfar.snr(picture, np.rint(picture * 65535) / 65535)).endswith(" dB")
