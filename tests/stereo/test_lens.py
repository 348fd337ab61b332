"""Lenses: OpenCV's own functions are the oracle."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.stereo.lens import Lens, distort, undistort

cv2 = pytest.importorskip("cv2")

MATRIX = np.array([[310.0, 0.4, 158.0], [0, 305.0, 121.0], [0, 0, 1]])
COEFFICIENTS = {
    0: [],
    4: [-0.2, 0.1, 0.003, -0.002],
    5: [-0.2, 0.1, 0.003, -0.002, 0.04],
    8: [0.3, -0.1, 0.002, 0.001, 0.05, 0.5, -0.1, 0.02],
    12: [-0.2, 0.1, 0.003, -0.002, 0.04, 0.01, 0.02, 0.003, 0.001, -0.002, 0.002, 0.001],
}


def lens(count):
    return Lens(Size(240, 320), MATRIX, np.array(COEFFICIENTS[count]))


@pytest.fixture
def points():
    generator = np.random.default_rng(3)
    return generator.uniform([-0.5, -0.4, 0.8], [0.5, 0.4, 1.4], (200, 3))


@pytest.mark.parametrize("count", COEFFICIENTS)
def test_points_fall_where_opencv_says(count, points):
    # OpenCV has no skew.
    matrix, none = MATRIX * [[1, 0, 1], [1, 1, 1], [1, 1, 1]], np.zeros(3)
    without = Lens(Size(240, 320), matrix, np.array(COEFFICIENTS[count]))
    expected, _ = cv2.projectPoints(points, none, none, matrix, np.array(COEFFICIENTS[count]))
    np.testing.assert_allclose(without.project(points)[0], expected[:, 0], atol=1e-9)


@pytest.mark.parametrize("count", COEFFICIENTS)
def test_pixels_move_with_points_as_finite_differences_do(count, points):
    _, motion = lens(count).project(points)
    for axis in range(3):
        step = 1e-6 * np.eye(3)[axis]
        ahead, behind = (lens(count).project(points + sign * step)[0] for sign in (1, -1))
        np.testing.assert_allclose(motion[:, :, axis], (ahead - behind) / 2e-6, atol=1e-4)


@pytest.mark.parametrize("count", COEFFICIENTS)
def test_rays_lead_back(count, points):
    rays = lens(count).rays(lens(count).project(points)[0])
    np.testing.assert_allclose(rays, points / points[:, 2:], atol=1e-9)


def test_what_no_point_is_distorted_into_is_nowhere():
    # The distorted radius r - r^3 never passes 0.385.
    coefficients = np.array([-1.0, 0, 0, 0])
    found = undistort(np.array([[0.3, 0.0], [0.5, 0.0]]), coefficients)
    assert distort(found[:1], coefficients)[0] == pytest.approx(np.array([[0.3, 0.0]]))
    assert np.isnan(found[1]).all()
