"""The Haar transform: orthonormal at any size, the standard one at powers of two."""

import numpy as np
import pytest
import pywt

from nearfar.arrays import Size
from nearfar.baselines.haar import haar, inverse_haar

SIZES = (Size(1, 1), Size(1, 9), Size(5, 1), Size(5, 7), Size(8, 8), Size(12, 17), Size(17, 25))


def _matrix(size):
    return haar(np.eye(size.pixels).reshape(-1, *size)).reshape(size.pixels, size.pixels)


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_it_is_orthonormal_and_its_inverse_is_its_adjoint(size):
    matrix = _matrix(size)
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(size.pixels), atol=1e-12)
    back = inverse_haar(np.eye(size.pixels).reshape(-1, *size)).reshape(matrix.shape)
    np.testing.assert_allclose(back, matrix.T, atol=1e-12)


@pytest.mark.parametrize("side", [2, 8, 32])
def test_at_powers_of_two_it_is_the_standard_transform(side):
    pictures = np.random.default_rng(0).normal(size=(3, side, side))
    for picture, found in zip(pictures, haar(pictures), strict=True):
        expected, _ = pywt.coeffs_to_array(pywt.wavedec2(picture, "haar", mode="periodization"))
        np.testing.assert_allclose(found, expected, atol=1e-12)


def test_a_longer_side_goes_on_alone():
    picture = np.random.default_rng(1).normal(size=(4, 16))
    expected, _ = pywt.coeffs_to_array(
        pywt.wavedec2(picture, "haar", mode="periodization", level=2)
    )
    rest = pywt.wavedec(expected[0, :4], "haar", mode="periodization")
    expected[0, :4] = np.concatenate(rest)
    np.testing.assert_allclose(haar(picture), expected, atol=1e-12)


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_a_constant_is_the_first_coefficient_and_wavelets_have_no_mean(size):
    constant = haar(np.full(size, 3.0))
    assert constant[0, 0] == pytest.approx(3.0 * np.sqrt(size.pixels))
    assert np.abs(constant.ravel()[1:]).max(initial=0) < 1e-12


def test_one_pixel_is_few_coefficients():
    for size in (Size(68, 100), Size(64, 64)):
        spike = np.zeros(size)
        spike[size.height // 3, size.width - 1] = 1.0
        assert np.count_nonzero(haar(spike)) <= 3 * 7 + 1


def test_pictures_keep_their_precision_and_are_left_alone():
    pictures = np.random.default_rng(2).random((4, 6, 5), dtype=np.float32)
    before = pictures.copy()
    coefficients = haar(pictures)
    assert coefficients.dtype == np.float32
    np.testing.assert_allclose(inverse_haar(coefficients), pictures, atol=1e-6)
    assert np.array_equal(pictures, before)
    whole = np.arange(30).reshape(5, 6)
    np.testing.assert_allclose(haar(whole), haar(whole.astype(float)), atol=1e-12)
    np.testing.assert_allclose(haar(pictures[:, :, ::-1]), haar(pictures[:, :, ::-1].copy()))
