"""Gains of lamps from photos of several, against gains that are known."""

import numpy as np
import pytest

from nearfar.estimate.light_stage import fit_gains, spread_of, sums_of

LAMPS, VALUES, BANDS = 20, 3000, 12


def _stage(seed, noise, *, shared_black=False):
    """Return bands of photos, which lamps are lit, and the gains."""
    generator = np.random.default_rng(seed)
    lamps = generator.gamma(2, 0.05, (LAMPS, VALUES))
    gains = generator.uniform(0.7, 1.4, LAMPS)
    lit = np.concatenate([np.ones((1, LAMPS)), generator.integers(0, 2, (3, LAMPS))])
    exposures = np.array([1.0, 1.02, 0.98, 1.0])
    references = (exposures[:, None] * lit * gains) @ lamps
    black = noise * generator.normal(size=VALUES) * shared_black
    seen = lamps + noise * generator.normal(size=lamps.shape) - black
    shown = references + noise * generator.normal(size=references.shape) - black
    bands = [(seen[:, i::BANDS], shown[:, i::BANDS]) for i in range(BANDS)]
    return sums_of(bands), lit, gains


def test_without_noise_gains_and_exposures_are_exact():
    sums, lit, gains = _stage(0, 0.0)
    found = fit_gains(sums, lit, share_black=False)
    np.testing.assert_allclose(found.gains, gains, rtol=1e-4)
    np.testing.assert_allclose(found.exposures, [1.0, 1.02, 0.98, 1.0], atol=1e-4)
    assert found.held_out_snr.min() > 60


@pytest.mark.parametrize("shared_black", [False, True])
def test_noise_of_the_lamps_photos_makes_no_gain_too_small(shared_black):
    off = []
    for seed in range(4):
        sums, lit, gains = _stage(seed, 0.02, shared_black=shared_black)
        found = fit_gains(sums, lit, share_black=shared_black)
        off.append((found.gains - gains).mean() / gains.mean())
    assert abs(np.mean(off)) < 0.01


@pytest.mark.parametrize("shared_black", [False, True])
def test_errors_are_those_of_the_gains(shared_black):
    ratios = []
    for seed in range(4):
        sums, lit, gains = _stage(seed, 0.01, shared_black=shared_black)
        found = fit_gains(sums, lit, share_black=shared_black)
        error = found.gains - gains
        covariance = found.errors.T @ found.errors
        ratios.append(error @ np.linalg.solve(covariance, error) / LAMPS)
    assert 0.4 < np.mean(ratios) < 1.8


def test_lamps_that_no_reference_shows_keep_their_gain_and_are_not_sure_of_it():
    sums, lit, _ = _stage(1, 0.01)
    lit = lit.copy()
    lit[:, 3] = 0.0
    found = fit_gains(sums, lit, share_black=False)
    assert found.gains[3] == pytest.approx(1.0, abs=0.03)
    assert found.deviations[3] > 0.4
    assert np.median(found.deviations) < 0.2


def test_what_is_left_has_the_variance_of_the_photos_in_it():
    generator = np.random.default_rng(0)
    weights = generator.random((2, 5))
    for shared in (False, True):
        black = generator.normal(size=100_000) * shared
        lamps, own = generator.normal(size=(5, 100_000)), generator.normal(size=(2, 100_000))
        left = (own - black) - weights @ (lamps - black)
        np.testing.assert_allclose(
            left.var(axis=1), spread_of(weights, share_black=shared), rtol=0.02
        )
