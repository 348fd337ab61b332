"""Lights to relight under: sizes, ranges, and what each is for."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.illumination.pictures import landscape, lettering, natural_picture, penguin


@pytest.mark.parametrize("size", [Size(1, 1), Size(7, 5), Size(68, 100), Size(128, 128)])
def test_pictures_are_lights_of_any_size(size):
    for light, channels in (
        (landscape(size), 3),
        (penguin(size), 3),
        (natural_picture(size, 1, colour=True), 3),
        (lettering(size), 0),
        (natural_picture(size, 1), 0),
    ):
        assert light.shape == ((*size, channels) if channels else size)
        assert light.dtype == np.float32
        assert light.min() >= 0.0
        assert light.max() <= 1.0


def test_the_sky_is_blue_and_the_ground_green():
    picture = landscape(Size(64, 64))
    assert picture[2].mean(axis=0).argmax() == 2
    assert picture[-3].mean(axis=0).argmax() == 1


def test_letters_hold_finer_detail_than_pictures():
    def share_of_high_frequencies(light: np.ndarray) -> float:
        energy = np.abs(np.fft.fft2(light - light.mean())) ** 2
        k = np.abs(np.fft.fftfreq(len(light)))
        return float(energy[np.maximum.outer(k, k) > 0.25].sum() / energy.sum())

    size = Size(96, 96)
    letters = share_of_high_frequencies(lettering(size))
    assert letters > 0.3
    assert letters > 5 * share_of_high_frequencies(natural_picture(size, 1))
    assert set(np.unique(lettering(size))) == {0.0, 1.0}


def test_a_picture_is_the_same_at_any_size():
    # Oversampled 4 times, 2 times and not at all.
    small, *larger = (natural_picture(Size(96 * n, 128 * n), 5) for n in (1, 8, 16))
    for light in larger:
        n = len(light) // 96
        averaged = light.reshape(96, n, 128, n).mean(axis=(1, 3))
        # What is left are edges, which oversampling by 4 finds to a quarter of a small pixel.
        assert np.sqrt(np.mean((averaged - small) ** 2)) < 0.1 * small.std()
