"""One white or black that differs from the others is told from drift."""

import numpy as np
import pytest

from nearfar.faults.of_light import ExposureChanged
from nearfar.faults.of_single_photos import PhotosMisfit
from nearfar.photometry.drift import References
from nearfar.workflow.diagnosis.odd_references import FEWEST, find_odd_references

REFERENCES = References(np.array([1, 12, 23, 34, 45]), np.array([0, 11, 22, 33, 44]))
SHAPE = (46, 20, 30, 2)
NOISE = 0.004


def photos(lamp=None):
    """Return photos of which whites and blacks alone matter, white 0.5 brighter than black."""
    generator = np.random.default_rng(0)
    taken = 0.05 + NOISE * generator.standard_normal(SHAPE)
    light = generator.uniform(0.2, 0.8, SHAPE[1:])
    gains = np.ones(5) if lamp is None else lamp
    for white, gain in zip(REFERENCES.whites, gains, strict=True):
        taken[white] += gain * light
    return taken.astype(np.float32)


def found(taken, references=REFERENCES):
    return find_odd_references(taken, references)


def test_good_ones_and_drift_are_left_alone():
    assert found(photos()) == []
    # A lamp that warms up, fades, or flickers.
    for lamp in (
        [0.9, 0.97, 0.99, 0.997, 1.0],
        np.linspace(1.0, 0.7, 5),
        [1.0, 1.02, 0.99, 1.03, 0.98],
    ):
        assert found(photos(lamp)) == []


@pytest.mark.parametrize("change", [0.03, -0.1])
@pytest.mark.parametrize("place", [1, 2, 3])
def test_one_under_other_light_is_named_with_its_change(place, change):
    lamp = np.linspace(1.0, 0.98, 5)
    lamp[place] += change
    (fault,) = found(photos(lamp))
    number = int(REFERENCES.whites[place])
    assert fault == ExposureChanged((number,), pytest.approx(change, abs=0.01), 0.0)
    taken = photos()
    taken[REFERENCES.blacks[place]] += change / 2
    (fault,) = found(taken)
    number = int(REFERENCES.blacks[place])
    assert fault == ExposureChanged((number,), 0.0, pytest.approx(change, abs=0.01))


def test_one_with_something_in_it_is_named():
    taken = photos()
    taken[23, :8, :9] *= 0.6
    assert found(taken) == [PhotosMisfit((23,))]


@pytest.mark.parametrize("place", [0, 4])
def test_the_first_and_the_last_may_be_drift_or_motion(place):
    lamp = np.ones(5)
    lamp[place] = 1.1
    assert found(photos(lamp)) == []
    taken = photos()
    taken[REFERENCES.whites[place]] = taken[REFERENCES.whites[place], :, ::-1]
    assert found(taken) == []


def test_few_of_them_tell_nothing():
    few = References(*(numbers[: FEWEST - 1] for numbers in REFERENCES))
    lamp = np.ones(5)
    lamp[2] = 1.1
    assert found(photos(lamp), few) == []
