"""What neighbours tell of black, near- and far-range light."""

import numpy as np

from nearfar.arrays import Size
from nearfar.estimate.any_patterns.neighbours import adjacent, expect_black, expect_rows

CAMERA = Size(24, 30)


def test_neighbours_tell_black_better_than_a_photo_but_not_across_an_edge():
    generator = np.random.default_rng(0)
    true = np.full((*CAMERA, 1), 0.03)
    true[:, 15:] = 0.2
    noise = np.full(true.shape, 1e-3)
    black = (true + noise * generator.standard_normal(true.shape)).reshape(-1, 1)
    found = expect_black(black, noise.reshape(-1, 1), CAMERA)
    error, variance = (
        (part.reshape(CAMERA)) for part in (found.mean - true.reshape(-1, 1), found.variance)
    )
    flat = np.r_[2:12, 18:28]
    assert np.std(error[:, flat]) < 0.3e-3
    # Errors are at most as large as is said of them.
    assert 0.3 < np.mean(error[:, flat] ** 2 / variance[:, flat]) < 1.1
    assert (variance[:, 14:16] > 0.05**2).all()


def test_neighbours_are_those_around():
    found = adjacent(Size(4, 6))
    assert sorted(found[0][found[0] >= 0]) == [1, 2, 6, 7, 8, 12, 13, 14]
    assert found.shape == (24, 24)


def test_rows_are_the_mean_of_lit_neighbours_at_the_pixel_s_own_brightness():
    camera = Size(1, 4)
    level = np.array([[1.0], [2.0], [4.0], [1.0]])
    near = level[..., None] * np.array([1.0, 3.0], dtype=np.float32)
    far = level[..., None] * np.array([2.0], dtype=np.float32)
    lit = np.array([True, True, True, False])
    far[3] = near[3] = 100.0
    found = expect_rows(near, far, level, lit, adjacent(camera), np.array([0, 1, 3]))
    np.testing.assert_allclose(found.near[:2, 0], [[1.0, 3.0], [2.0, 6.0]])
    np.testing.assert_allclose(found.far[:2, 0], [[2.0], [4.0]])
    # None of its neighbours is as it is.
    assert not found.near[2].any()
