"""Fits of ramps, of exposures and of noise, against what the numbers were made from."""

import numpy as np
import pytest

from nearfar.errors import InputError
from nearfar.photometry.exposures import Sensor, average, merge_exposures
from nearfar.photometry.response import (
    fit_linearity,
    fit_response,
    fit_sensor_noise,
    pair_noise,
    unmix_response,
)

LEVELS = np.unique(np.rint(np.linspace(0, 255, 33)).astype(int))
EVERY = np.arange(256) / 255


def _s_curve(x):
    return x**2.2 / (x**2.2 + 0.4 * (1 - x) ** 1.5 + 1e-12)


@pytest.mark.parametrize("curve", [lambda x: x**2.2, lambda x: x, _s_curve, lambda x: x**0.6])
def test_a_response_is_found_between_the_levels_of_its_ramp(curve):
    light = 300.0 + 5000.0 * curve(LEVELS / 255)
    found = fit_response(LEVELS, light)
    assert found[0] == 0
    assert found[-1] == 1
    assert (np.diff(found) >= 0).all()
    # Where it is steep as a root at black, no ramp of 33 levels is closer.
    assert np.abs(found - curve(EVERY)).max() < (2e-3 if curve(0.01) < 0.02 else 2e-2)


def test_noise_makes_no_response_that_falls():
    generator = np.random.default_rng(0)
    light = (LEVELS / 255) ** 2.2 + generator.normal(0, 0.01, LEVELS.size)
    found = fit_response(np.repeat(LEVELS, 2), np.repeat(light, 2))
    assert (np.diff(found) >= 0).all()
    assert np.abs(found - EVERY**2.2).max() < 0.03


def test_each_primary_is_found_in_a_colour_camera():
    gammas = (1.8, 2.2, 2.6)
    own = np.stack([(LEVELS / 255) ** g for g in gammas], axis=-1)
    mixing = np.array([[0.6, 0.1, 0.02], [0.15, 0.7, 0.1], [0.05, 0.2, 0.5]])
    found = unmix_response(LEVELS, own @ mixing.T, mixing)
    for i, gamma in enumerate(gammas):
        assert np.abs(found[:, i] - EVERY**gamma).max() < 2e-3


@pytest.mark.parametrize(
    ("levels", "light"),
    [
        ([0, 128, 255], [0, 1, 2]),
        ([10, 60, 100, 150, 200, 255], range(6)),
        ([0, 60, 100, 150, 255], [5, 4, 3, 2, 1]),
        ([0, 60, 100, 150, 255], [7] * 5),
    ],
)
def test_a_ramp_that_tells_nothing_is_refused(levels, light):
    with pytest.raises(InputError):
        fit_response(np.array(levels), np.array(light, dtype=float))


def test_black_level_and_line_of_a_camera():
    seconds = np.array([1, 2, 3, 4, 5, 8]) / 60
    found = fit_linearity(seconds, 1310 + 40_000 * seconds, 65535)
    assert found.black == pytest.approx(1310, abs=1)
    assert found.worst < 1e-6
    bent = fit_linearity(seconds, 1310 + 400_000 * seconds - 1e6 * seconds**2, 65535)
    assert bent.worst > 0.01
    with pytest.raises(InputError):
        fit_linearity(seconds[:1], seconds[:1], 1.0)


def _photos(rate, seconds, sensor, generator, full=65535.0):
    electrons = generator.poisson(rate * seconds)
    read = generator.normal(0, sensor.read, np.shape(electrons))
    return np.clip(np.rint(sensor.black + sensor.gain * electrons + read), 0, full)


@pytest.mark.parametrize("sensor", [Sensor(1310.0, 2.2, 9.0), Sensor(64.0, 0.25, 1.5)])
def test_the_noise_of_pairs_tells_gain_and_read_noise(sensor):
    generator = np.random.default_rng(1)
    rate = generator.uniform(0, 25_000, 40_000)
    means, variances = [], []
    for share in (0.01, 0.05, 0.2, 0.5, 1.0):
        one, other = (_photos(rate, share, sensor, generator) for _ in range(2))
        mean, variance = pair_noise(one, other, 65535.0)
        means.append(mean)
        variances.append(variance)
    found = fit_sensor_noise(np.concatenate(means), np.concatenate(variances), sensor.black)
    assert found.gain == pytest.approx(sensor.gain, rel=0.05)
    assert found.read == pytest.approx(sensor.read, rel=0.2)


def test_a_bracket_is_as_good_as_its_light_allows():
    sensor, generator = Sensor(1310.0, 2.2, 9.0), np.random.default_rng(2)
    rate = np.repeat([30.0, 300.0, 3000.0, 25_000.0], 5000)
    times = (1.0, 4.0, 16.0)
    frames = np.stack([_photos(rate, t, sensor, generator) for t in times])
    merged = merge_exposures(frames, times, sensor, 65535.0)
    found = (merged - sensor.black) / sensor.gain
    for level in np.unique(rate):
        values = found[rate == level]
        usable = [t for t in times if sensor.black + sensor.gain * level * t < 0.98 * 65535]
        read = sensor.read / sensor.gain
        best = 1 / sum(t**2 / (level * t + read**2) for t in usable)
        assert values.mean() == pytest.approx(level, rel=0.01)
        assert values.var() < 1.15 * best
        assert values.var() < 0.6 * (level + read**2) or len(usable) == 1


def test_what_is_saturated_stays_so():
    frames = np.array([[65535, 100], [65535, 400]], dtype=np.uint16)
    assert merge_exposures(frames, (1.0, 4.0), Sensor(), 65535.0)[0] == 65535
    frames = np.array([[65535.0, 10], [60_000, 12]])
    np.testing.assert_array_equal(average(frames, 65535.0), [65535, 11])
