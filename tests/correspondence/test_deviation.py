"""The error bar of q against errors that are known."""

import numpy as np
import pytest

from nearfar.correspondence.deviation import LEAST_DEVIATION, deviation_of


def surface(width, side=60, noise=0.0, seed=0):
    """q of a plane whose camera pixels are so wide on the projector, and of the same with noise."""
    rows, columns = np.indices((side, side))
    exact = np.stack([width * rows + 0.3, width * columns + 0.7], axis=-1)
    return exact, exact + noise * np.random.default_rng(seed).normal(size=exact.shape)


def test_noise_is_found():
    _, q = surface(1.0, noise=0.2)
    assert np.median(deviation_of(q)) == pytest.approx(np.hypot(0.2, LEAST_DEVIATION), rel=0.1)


def test_noise_on_one_axis_is_found_on_that_axis():
    exact, q = surface(1.0, noise=0.2)
    q[..., 1] = exact[..., 1]
    found = deviation_of(q)
    assert np.median(found[..., 0]) > 0.18
    np.testing.assert_allclose(found[..., 1], LEAST_DEVIATION, rtol=1e-3)


@pytest.mark.parametrize("width", [0.37, 0.618, 1.41])
def test_the_centroid_of_whole_pixels_errs_as_is_said(width):
    # The centroid of the whole pixels that each footprint covers, by summing many places in it.
    exact, _ = surface(width, side=90)
    within = (np.arange(400) + 0.5) / 400 - 0.5
    q = np.rint(exact[..., None] + width * within).mean(axis=-1)
    error = q - exact
    found = deviation_of(q)
    ratio = np.sqrt(np.mean(found**2 - LEAST_DEVIATION**2)) / np.sqrt(np.mean(error**2))
    assert 0.7 < ratio < 1.4


def test_unlit_camera_pixels_have_none_and_lonely_ones_the_usual_one():
    _, q = surface(1.0, noise=0.2)
    q[10:40, 10:40] = np.nan
    q[25, 25] = 7.0
    found = deviation_of(q)
    np.testing.assert_array_equal(np.isnan(found), np.isnan(q))
    lonely = np.median(found[np.isfinite(found)])
    np.testing.assert_allclose(found[25, 25], lonely, rtol=0.1)


def test_a_row_of_one_pixel_has_the_least():
    np.testing.assert_allclose(deviation_of(np.zeros((1, 1, 2))), LEAST_DEVIATION, rtol=1e-3)
