"""The search for q along rows and then down, against every place by itself."""

from fractions import Fraction

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.correspondence.phase import _scores, _search, _waves
from nearfar.correspondence.weighing import Weighed
from nearfar.illumination.frequencies import (
    Frequency,
    far_frequencies,
    near_frequencies,
    representatives,
)
from nearfar.illumination.real_basis import real_basis

PROJECTOR = Size(10, 13)
# Its own negative: a cosine without a sine.
EVEN = Frequency(Fraction(-1, 2), Fraction(0))
BAND = [
    *representatives(near_frequencies(5, Size(1, 1))),
    *representatives(far_frequencies(Size(4, 3), PROJECTOR)),
]


@pytest.fixture
def basis():
    found = real_basis([*(k for k in dict.fromkeys(BAND) if any(k)), EVEN], PROJECTOR)
    assert (~found.is_sine).sum() == found.is_sine.sum() + 1
    return found


def test_scores_are_sums_over_responses(basis):
    responses = np.random.default_rng(0).normal(size=(20, basis.count)).astype(np.float32)
    expected = (responses @ basis.patterns).reshape(20, *PROJECTOR)
    np.testing.assert_allclose(_scores(responses, _waves(basis)), expected, atol=1e-4)


@pytest.mark.parametrize("noise", [0.0, 0.5, 5.0])
def test_no_place_explains_the_responses_better(basis, noise):
    generator = np.random.default_rng(1)
    # Light at whole pixels, between two and among four, and noise up to where there is none.
    places = generator.integers(0, 2 * (np.array(PROJECTOR) - 1) + 1, size=(200, 2)) / 2
    responses = _patterns_at(basis, places) + noise * generator.normal(size=(200, basis.count))
    weights = generator.uniform(0.2, 2.0, size=(200, len(basis.frequencies)))
    weighed = Weighed(
        (responses * weights[:, basis.index]).astype(np.float32), weights.astype(np.float32)
    )
    every = np.stack(np.meshgrid(*(np.arange(2 * s - 1) / 2 for s in PROJECTOR), indexing="ij"), -1)
    every = every.reshape(-1, 2)
    patterns = _patterns_at(basis, every)
    deviations = (weighed.responses @ patterns.T) / np.sqrt(weights @ _shared(basis, every).T)
    found = _search(basis, _waves(basis), weighed)
    index = (2 * found @ np.array([2 * PROJECTOR.width - 1, 1])).astype(int)
    best = deviations.max(axis=1)
    np.testing.assert_allclose(deviations[np.arange(200), index], best, rtol=1e-4)
    if noise == 0.0:
        np.testing.assert_array_equal(found, places)


def _patterns_at(basis, places):
    """Mean of the patterns at the whole pixels around each place, (n, R)."""
    drawn = basis.patterns.reshape(basis.count, *PROJECTOR)
    low, high = np.floor(places).astype(int), np.ceil(places).astype(int)
    corners = [drawn[:, y, x] for y in (low[:, 0], high[:, 0]) for x in (low[:, 1], high[:, 1])]
    return np.mean(corners, axis=0).T


def _shared(basis, places):
    """Share of each frequency's energy that light at a place between pixels keeps, (n, K)."""
    between = places != np.rint(places)
    kept = np.cos(np.pi * basis.cycles) ** 2
    return np.prod(np.where(between[:, None], kept, 1.0), axis=-1)
