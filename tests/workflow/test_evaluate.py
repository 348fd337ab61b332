"""SNR as the paper defines it."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.illumination.pictures import natural_picture, standard_lights
from nearfar.workflow.evaluate import HIGHEST, model_truth, row_snr, snr, split_snr
from tests.estimate.test_fit import _exact_of
from tests.worlds import model_transport

PROJECTOR, CAMERA = Size(12, 15), Size(5, 6)


@pytest.fixture
def world():
    return model_transport(PROJECTOR, CAMERA, window=5, far=Size(3, 3), channels=2)


def test_snr_counts_decibels():
    truth = np.ones((3, 4))
    assert snr(truth, 0.9 * truth) == pytest.approx(20)
    assert snr(truth, truth) == HIGHEST
    assert snr(0 * truth, truth) == -HIGHEST


def test_rows_and_frequencies_are_as_by_hand(world):
    exact = _exact_of(world)
    estimate = world.with_gains(direct=1.01, near=0.9, far=1.02)
    rows = row_snr(estimate, exact)
    truth, found = world.dense().astype(float), estimate.dense().astype(float)
    for c in (0, 7, 29):
        by_hand = 20 * np.log10(np.linalg.norm(truth[c]) / np.linalg.norm(truth[c] - found[c]))
        assert rows.snr_t.ravel()[c] == pytest.approx(by_hand, abs=1e-3)
    y, x = np.indices(PROJECTOR)
    for ky, kx in ((0, 0), (2, 5), (-3, 1), (-6, -7)):
        light = np.exp(-2j * np.pi * (ky * y / 12 + kx * x / 15)).ravel()
        signal, error = truth @ light, (truth - found) @ light
        by_hand = 20 * np.log10(np.linalg.norm(signal) / np.linalg.norm(error))
        assert rows.snr_b_of_frequency[6 + ky, 7 + kx] == pytest.approx(by_hand, abs=1e-3)
    assert rows.components["D"] == pytest.approx(40, abs=1e-3)
    assert rows.components["N"] == pytest.approx(20, abs=1e-3)


def test_the_models_split_of_a_model_world_is_its_own(world):
    exact = _exact_of(world)
    split = split_snr(world, model_truth(world, exact))
    assert min(split.values()) > 45


def test_standard_lights_are_lights():
    for size in (Size(16, 16), Size(9, 31)):
        lights = standard_lights(size)
        assert next(iter(lights)) == "white"
        assert len(lights) == 7
        for light in lights.values():
            assert light.shape == size
            assert light.dtype == np.float32
            assert 0 <= light.min() <= light.max() <= 1


def test_natural_pictures_have_the_spectrum_of_pictures():
    # Energy falls about as 1/f^2 per frequency (f^-2 to f^-3.5 here), the same in any run.
    size = Size(128, 128)
    k = np.hypot(*np.meshgrid(np.fft.fftfreq(128), np.fft.fftfreq(128)))
    slopes = []
    for seed in range(1, 6):
        picture = natural_picture(size, seed)
        energy = np.abs(np.fft.fft2(picture - picture.mean())) ** 2
        octaves = [energy[(k > a) & (k <= 2 * a)].mean() for a in (0.02, 0.04, 0.08, 0.16)]
        slopes.append(np.log2(octaves[0] / octaves[-1]) / 3)
        np.testing.assert_array_equal(picture, natural_picture(size, seed))
    assert 2.0 < np.mean(slopes) < 3.5
