"""Free rows, against least squares and against Gaussian conditioning written out."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.estimate.error_bars import ErrorBars
from nearfar.estimate.free_rows.design import design_of
from nearfar.estimate.free_rows.error_bars import variance_in_noise
from nearfar.estimate.free_rows.estimate import estimate_free_rows, posterior_of
from nearfar.illumination.real_basis import basis_of_every_frequency
from nearfar.transport.model import Transport
from nearfar.transport.posterior import FreePosterior
from nearfar.transport.verdict import KeptVerdict
from tests.estimate.lights_together import assert_each_light_has_its_own_errors

LAMPS, PIXELS, BLACK = 32, 200, 0.03


def _hadamard(order):
    pixels = np.arange(order, dtype=np.uint64)
    return 1.0 - (np.bitwise_count(pixels[:, None] & pixels) & 1)


def _random(count):
    return np.random.default_rng(5).integers(0, 2, (count, LAMPS)).astype(float)


DARK, WHITE = np.zeros((1, LAMPS)), np.ones((1, LAMPS))
COMPLETE = {
    "one at a time": np.concatenate([np.eye(LAMPS), DARK]),
    "Hadamard": np.concatenate([_hadamard(LAMPS), DARK]),
    "Hadamard and inverses": np.concatenate([_hadamard(LAMPS), 1 - _hadamard(LAMPS)]),
    "random": np.concatenate([_random(80), DARK, DARK]),
}


@pytest.fixture(scope="module")
def world():
    """Rows of no order, (C, P): some lamps are a hundred times as bright as others."""
    generator = np.random.default_rng(0)
    rows = 0.02 * generator.uniform(0, 1, (PIXELS, LAMPS)) ** 3
    rows[np.arange(PIXELS // 2), generator.integers(0, LAMPS, PIXELS // 2)] += 0.3
    return rows


def _photos(world, patterns, noise=0.0):
    exact = world @ patterns.T + BLACK
    seen = exact + noise * np.random.default_rng(1).normal(size=exact.shape)
    return seen[:, None].astype(np.float32)


def _rows(found):
    """Return the rows that an estimate has found, (C, P)."""
    rows = found.free[:, 0].astype(float)
    lit = np.flatnonzero(found.lamp >= 0)
    rows[lit, found.lamp[lit]] += found.direct[lit, 0]
    return rows


def _decibels(world, rows):
    return 10 * np.log10((world**2).sum() / ((rows - world) ** 2).sum())


@pytest.mark.parametrize("name", COMPLETE)
def test_without_noise_a_complete_set_gives_every_row(world, name):
    found = estimate_free_rows(_photos(world, COMPLETE[name]), design_of(COMPLETE[name]))
    assert _decibels(world, _rows(found)) > 100
    np.testing.assert_allclose(found.black, BLACK, atol=1e-5)


@pytest.mark.parametrize("name", COMPLETE)
def test_with_noise_it_is_not_below_least_squares(world, name):
    patterns = COMPLETE[name]
    photos = _photos(world, patterns, 0.003)
    found = estimate_free_rows(photos, design_of(patterns))
    with_black = np.concatenate([np.ones((len(patterns), 1)), patterns], axis=1)
    least_squares = photos[:, 0] @ np.linalg.pinv(with_black).T[:, 1:]
    assert _decibels(world, _rows(found)) > _decibels(world, least_squares) - 0.3


def test_the_lamp_that_stands_out_is_direct_light_and_no_other(world):
    patterns = COMPLETE["Hadamard and inverses"]
    found = estimate_free_rows(_photos(world, patterns, 0.001), design_of(patterns))
    lit = np.arange(PIXELS) < PIXELS // 2
    assert (found.lamp[lit] == world[lit].argmax(axis=1)).mean() > 0.98
    assert (found.lamp[~lit] >= 0).mean() < 0.02


def test_a_given_lamp_is_taken():
    world = np.full((4, LAMPS), 0.01)
    design = design_of(COMPLETE["random"])
    lamps = np.array([3, -1, 7, 0])
    found = estimate_free_rows(_photos(world, COMPLETE["random"], 0.001), design, lamps)
    assert found.lamp.tolist() == lamps.tolist()


def test_without_a_photo_under_black_black_is_0():
    world = np.full((4, LAMPS), 0.01)
    design = design_of(_hadamard(LAMPS))
    assert not design.has_black
    found = estimate_free_rows((world @ _hadamard(LAMPS).T)[:, None], design)
    assert not found.black.any()
    np.testing.assert_allclose(_rows(found), world, atol=1e-6)


def test_from_few_photos_the_noise_is_told_by_what_was_shot_twice(world):
    patterns = np.concatenate([_random(20), DARK, DARK, WHITE, WHITE, WHITE])
    found = estimate_free_rows(_photos(world, patterns, 0.01), design_of(patterns))
    assert np.median(found.noise) == pytest.approx(0.01, rel=0.3)


def _conditioned(patterns, ratio, noise):
    """Return the posterior covariance of a row and of direct light, which stands behind its lamps.

    Flat priors are variances of 1e6 s^2.
    """
    flat = 1e6
    prior = np.zeros((LAMPS + 1, LAMPS + 1))
    prior[:LAMPS, :LAMPS] = ratio * (np.eye(LAMPS) + flat * np.ones((LAMPS, LAMPS)))
    prior[LAMPS, LAMPS] = ratio * flat
    of_photos = patterns @ prior @ patterns.T + np.eye(len(patterns)) + ratio * flat
    across = prior @ patterns.T
    return noise**2 * (prior - across @ np.linalg.solve(of_photos, across.T))


@pytest.mark.parametrize("lamp", [-1, 5])
@pytest.mark.parametrize("name", ["few", "Hadamard and inverses"])
def test_error_bars_are_those_of_gaussian_conditioning(name, lamp):
    few = np.concatenate([_random(12), DARK, DARK, WHITE, WHITE])
    patterns = {"few": few, **COMPLETE}[name]
    ratio = 3.0
    posterior = posterior_of(design_of(patterns), np.array([ratio], np.float32))
    own = patterns[:, [lamp]] if lamp >= 0 else np.zeros((len(patterns), 1))
    covariance = _conditioned(np.concatenate([patterns, own], axis=1), ratio, 1.0)
    for light in (*np.random.default_rng(2).random((3, LAMPS)), np.eye(LAMPS)[5], WHITE[0]):
        variance = variance_in_noise(posterior, np.array([lamp]), light[None], 1.0, 1.0)
        both = np.append(light, light[lamp] if lamp >= 0 else 0.0)
        assert variance[0, 0] == pytest.approx(both @ covariance @ both, rel=2e-3)


def test_error_bars_of_a_transport_are_those_of_its_direct_light_and_of_each_lamp():
    few = np.concatenate([_random(12), DARK, DARK, WHITE, WHITE])
    lamps, ratio, noise = np.array([5, 9, -1]), 3.0, np.float32([0.1, 0.2, 0.3])
    projector = Size(4, LAMPS // 4)
    q = np.stack(np.divmod(lamps, projector.width), axis=-1).astype(np.float32)
    q[lamps < 0] = np.nan
    transport = Transport(
        projector=projector,
        correspondence=q[None],
        direct=np.zeros((1, 3, 1), np.float32),
        near=np.zeros((1, 3, 1, 0, 0), np.float32),
        far=np.zeros((1, 3, 1, LAMPS), np.float32),
        far_basis=basis_of_every_frequency(projector),
        black=np.zeros((1, 3, 1), np.float32),
        noise=noise[None, :, None],
        parts=("direct", "free"),
        posterior=posterior_of(design_of(few), np.full((1, 3), ratio, np.float32)),
        verdict=KeptVerdict("doubtful", widening=2.0),
    )
    bars = ErrorBars(transport)
    # Direct light is one lamp more, which shines where the lamp does.
    rows = bars.component_rows(slice(None))
    light = np.random.default_rng(2).random(projector).astype(np.float32)
    relit, free_alone = bars.picture(light)[0], bars.picture(light, direct=0.0)[0]
    for c, lamp in enumerate(lamps):
        own = few[:, [lamp]] if lamp >= 0 else np.zeros((len(few), 1))
        covariance = _conditioned(np.concatenate([few, own], axis=1), ratio, noise[c])
        known = 2.0 * np.sqrt(np.diag(covariance))
        direct = known[-1] if lamp >= 0 else 0.0
        np.testing.assert_allclose(rows.far[c, 0], known[:-1], rtol=2e-3)
        assert bars.direct()[0, c, 0] == pytest.approx(direct, rel=2e-3)
        assert rows.direct[c, 0].sum() == rows.direct[c, 0, lamp] == pytest.approx(direct, rel=2e-3)
        assert not rows.near[c].any()
        lights = np.append(light, light.ravel()[lamp] if lamp >= 0 else 0.0)
        both = 2.0 * np.sqrt(lights @ covariance @ lights)
        assert relit[c] == pytest.approx(both, rel=2e-3)
        lights[-1] = 0.0
        alone = 2.0 * np.sqrt(lights @ covariance @ lights)
        assert free_alone[c] == pytest.approx(alone, rel=2e-3)
    np.testing.assert_allclose(bars.along(0, 1).far[0], rows.far[0, 0, 8:16], rtol=1e-6)
    assert_each_light_has_its_own_errors(transport)


def test_error_bars_hold_for_rows_as_they_are_expected():
    generator = np.random.default_rng(3)
    world = 0.01 + 0.003 * generator.normal(size=(500, LAMPS))
    patterns = np.concatenate([_random(20), DARK, DARK, WHITE, WHITE])
    design = design_of(patterns)
    found = estimate_free_rows(_photos(world, patterns, 0.002), design)
    posterior = posterior_of(design, found.ratio)
    assert isinstance(posterior, FreePosterior)
    light = generator.random(LAMPS)
    (variance,) = variance_in_noise(posterior, found.lamp, light[None], 1.0, 1.0)
    error = (_rows(found) - world) @ light / (found.noise[:, 0] * np.sqrt(variance))
    assert 0.9 < np.sqrt(np.mean(error**2)) < 1.15


def test_a_complete_set_with_no_photo_to_spare_has_no_error_bars():
    design = design_of(COMPLETE["Hadamard"])
    assert posterior_of(design, np.ones(1, np.float32)) is None
