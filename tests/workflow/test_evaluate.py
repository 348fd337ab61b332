"""SNR as the paper defines it."""

import json
from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.illumination.pictures import natural_picture, standard_lights
from nearfar.report.differences import difference_gain
from nearfar.workflow.evaluate import HIGHEST, model_truth, row_snr, snr, split_snr
from nearfar.workflow.judge import (
    Pair,
    describe_units,
    find_faults_of_units,
    judge_by_truth,
    judge_pairs,
)
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


def _elsewhere(world):
    """A transport whose photos come from a camera that does not know its exposure."""
    return replace(world, provenance={"rig": {"description": "imported photos"}})


@pytest.mark.parametrize("units", [1.0, 5000.0, 1e-4])
def test_the_exposure_is_fitted_where_no_rig_knows_it(world, units):
    estimate = _elsewhere(world.with_gains(direct=1.01, near=0.9, far=1.02))
    found, known = (
        judge_by_truth(estimate, units * _exact_of(world)),
        judge_by_truth(replace(estimate, provenance={}), _exact_of(world)),
    )
    assert found["exposure_is_fitted"]
    assert not known["exposure_is_fitted"]
    assert found["exposure"] * units == pytest.approx(1.0, abs=0.02)
    assert found["snr_b_pictures"] >= known["snr_b_pictures"] - 0.01
    assert found["snr_t"]["p50"] == pytest.approx(known["snr_t"]["p50"], abs=1.5)
    assert "multiplied by" in describe_units(found)[0]
    assert describe_units(known) == []


def test_a_recorded_exposure_is_kept_and_other_units_are_told(world):
    recorded = replace(world, provenance={"rig": {"transport_exposure": 1.0}})
    exact = _exact_of(world)
    assert judge_by_truth(recorded, 100.0 * exact)["snr_b_pictures"] < 1
    (fault,) = find_faults_of_units(recorded, 100.0 * exact, "T.npy")
    assert "multiplied by 0.01 " in fault
    assert find_faults_of_units(recorded, exact, "T.npy") == []


def test_rows_without_light_are_left_out_of_means(world):
    exact = _exact_of(world)
    dark = replace(exact, direct=(), near=(), far=exact.rows(slice(None)).swapaxes(0, 1).copy())
    # One row is dark, one next to dark.
    dark.far[:, 3] = 0.0
    dark.far[:, 11] = 1e-14
    estimate = world.with_gains(direct=1.01, near=1.0, far=1.0)
    found = judge_by_truth(estimate, dark)
    rows = row_snr(estimate, dark)
    assert found["pixels_without_light"] == 2
    assert np.flatnonzero(np.isnan(rows.snr_t)).tolist() == [3, 11]
    lit = rows.snr_t[np.isfinite(rows.snr_t)]
    assert found["snr_t"]["mean"] == pytest.approx(lit.mean())
    assert found["snr_t"]["p0"] > 30
    assert "2 camera pixels" in describe_units(found)[0]
    json.dumps(found, allow_nan=False)
    nothing = judge_by_truth(estimate, 0.0 * dark)
    json.dumps(nothing, allow_nan=False)


def test_photos_without_light_are_left_out_of_the_mean():
    light, photo = np.ones((2, 2)), np.full((3, 3), 0.5)
    pairs = {"lit": Pair(light, 0.9 * photo, photo), "dark": Pair(light, 0.01 * photo, 0 * photo)}
    found = judge_pairs(pairs)
    assert found["snr_b_mean"] == pytest.approx(20)
    assert found["pairs_without_light"] == ["dark"]
    assert judge_pairs({"dark": pairs["dark"]}) == {"snr_b": {"dark": -HIGHEST}, "snr_b_mean": -300}


def test_differences_are_made_as_bright_as_can_be_seen():
    generator = np.random.default_rng(0)
    for size in (0.4, 0.03, 2e-4):
        differences = [size * generator.uniform(-1, 1, (20, 20)), np.zeros((4, 4))]
        gain = difference_gain(differences)
        assert 0.3 < gain * size <= 1.02
        assert str(gain)[0] in "125"
    assert difference_gain([np.full((3, 3), 7.0)]) == 1
    assert difference_gain([np.zeros((3, 3))]) == 1
    # Noise of the arithmetic is not made visible.
    assert difference_gain([np.full((3, 3), 1e-7)]) == 1
    assert difference_gain([]) == 1
