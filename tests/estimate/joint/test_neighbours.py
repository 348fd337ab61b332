"""What neighbours expect."""

import numpy as np
import pytest

from nearfar.estimate.joint import neighbour_loops, neighbours


def _expect_each(*given):
    return neighbours.expect_each(*given)[0]


BY_ARRAYS = (_expect_each, neighbours.expect_together)


def _of_every_pixel(expect):
    def found(values, *more):
        shape, expected = values.shape[:2], np.empty_like(values)
        put = expect(values, *more, np.ones(shape, dtype=bool))
        put(np.arange(np.prod(shape)), expected.reshape(-1, *values.shape[2:]))
        return expected

    return found


BY_PIXEL = (
    _of_every_pixel(neighbour_loops.expect_each_by_pixel),
    _of_every_pixel(neighbour_loops.expect_together_by_pixel),
)


@pytest.fixture(params=[BY_ARRAYS, BY_PIXEL], ids=["by arrays", "by pixel"])
def filters(request):
    return request.param


def test_neighbours_that_agree_take_noise_away_and_edges_stay(filters):
    expect_each, expect_together = filters
    generator = np.random.default_rng(0)
    truth = np.zeros((40, 40, 1, 12))
    truth[:, 20:] = 1.0
    noisy = truth + 0.05 * generator.normal(size=truth.shape)
    every = np.ones((40, 40), dtype=bool)
    variance = np.full((40, 40, 1), 0.05**2)
    found = expect_each(noisy, np.ones((40, 40, 1)), variance, np.ones(12), np.arange(6, 12))
    flat = np.abs(np.arange(40) - 19.5) > 2
    assert np.std((found - truth)[:, flat]) < 0.6 * 0.05
    assert np.abs((found - truth)[:, 19:21]).max() < 4 * 0.05
    together = expect_together(noisy, np.ones((40, 40, 1)), variance, every)
    assert np.std((together - truth)[:, flat]) < 0.6 * 0.05
    assert np.abs((together - truth)[:, 19:21]).max() < 4 * 0.05


def test_rows_without_anything_in_common_are_left_as_they_are(filters):
    expect_each, _ = filters
    generator = np.random.default_rng(0)
    values = generator.normal(size=(20, 20, 1, 40))
    variance = np.full((20, 20, 1), 0.3**2)
    found = expect_each(values, np.ones((20, 20, 1)), variance, np.ones(40), np.arange(20, 40))
    assert np.std(found - values) < 0.05
    # Alike in the highest frequencies, they take noise from one another in the others.
    values[..., 20:] *= 0.3
    found = expect_each(values, np.ones((20, 20, 1)), variance, np.ones(40), np.arange(20, 40))
    assert np.std((found - values)[..., 20:]) > 0.4 * 0.3


def test_neighbours_without_a_say_are_not_heard(filters):
    _, expect_together = filters
    values = np.zeros((9, 9, 1, 2))
    values[4, 4] = 100.0
    known = np.ones((9, 9), dtype=bool)
    known[4, 4] = False
    found = expect_together(values, np.ones((9, 9, 1)), np.full((9, 9, 1), 1.0), known)
    assert not found.any()


@pytest.mark.parametrize("shape", [(1, 1), (1, 6), (7, 1), (5, 6)])
def test_what_is_alike_everywhere_stays_so_to_the_cameras_border(shape, filters):
    expect_each, expect_together = filters
    # Shares of white are; white itself is not.
    white = 1.0 + np.random.default_rng(1).random((*shape, 2))
    values, variance = 0.7 * white[..., None] * np.ones(3), np.full((*shape, 2), 0.01)
    found = expect_each(values, white, variance, np.ones(3), np.array([1, 2]))
    np.testing.assert_allclose(found, values, rtol=1e-12)
    np.testing.assert_allclose(
        expect_together(values, white, variance, np.ones(shape, dtype=bool)), values, rtol=1e-12
    )


def test_a_camera_pixel_that_is_not_known_is_the_mean_of_its_neighbours():
    generator = np.random.default_rng(2)
    values, white = generator.normal(size=(6, 7, 1, 5)), 1.0 + generator.random((6, 7, 1))
    known = np.indices((6, 7)).sum(axis=0) % 2 == 0
    values[~known] = 1e6
    selected, variance = np.flatnonzero(~known), np.full((6, 7, 1), 0.01)
    each, together = (np.empty((len(selected), 1, 5)) for _ in range(2))
    neighbour_loops.expect_each_by_pixel(
        values, white, variance, np.ones(5), np.array([3, 4]), known
    )(selected, each)
    every = np.ones((6, 7), dtype=bool)
    neighbour_loops.expect_together_by_pixel(values, white, variance, every, known)(
        selected, together
    )
    y, x = np.unravel_index(selected, known.shape)
    inner = (y > 0) & (y < 5) & (x > 0) & (x < 6)
    shares = values / white[..., None]
    mean = (shares[y[inner] - 1, x[inner]] + shares[y[inner] + 1, x[inner]]) / 4
    mean += (shares[y[inner], x[inner] - 1] + shares[y[inner], x[inner] + 1]) / 4
    expected = mean * white[y[inner], x[inner], :, None]
    np.testing.assert_allclose(each[inner], expected, rtol=1e-12)
    np.testing.assert_allclose(together[inner], expected, rtol=1e-12)


@pytest.mark.parametrize("shape", [(1, 1), (1, 6), (2, 5), (6, 7)])
def test_noise_that_is_left_is_that_of_the_mean(shape):
    # Far less of it than the variance says, so that every camera pixel takes the mean.
    generator = np.random.default_rng(3)
    variance = 1.0 + generator.random((*shape, 1))
    ones, one = np.ones((*shape, 1)), np.ones(1)
    sums = np.zeros(shape)
    for place in np.ndindex(shape):
        values = np.full((*shape, 1, 1), 5.0)
        values[place] += 1e-3
        found, left = neighbours.expect_each(values, ones, variance, one, np.array([0]))
        sums += ((found[..., 0, 0] - 5.0) / 1e-3) ** 2 * variance[(*place, 0)]
    np.testing.assert_allclose(left[..., 0], sums / variance[..., 0], rtol=1e-6)


def test_all_noise_is_left_where_rows_have_nothing_in_common():
    values = np.random.default_rng(0).normal(size=(20, 20, 1, 40))
    variance = np.full((20, 20, 1), 1e-6)
    _, left = neighbours.expect_each(
        values, np.ones((20, 20, 1)), variance, np.ones(40), np.arange(20, 40)
    )
    assert 0.99 < left.min() <= left.max() <= 1.0
