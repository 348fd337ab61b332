"""The functions of near-range light: their number, their sums, what they interpolate."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.illumination.frequencies import far_frequencies
from nearfar.illumination.near_basis import NearBasis, basis_of, hat_response, window_offsets
from nearfar.illumination.real_basis import real_basis

BASES = [NearBasis(5, 1), NearBasis(5, 2), NearBasis(7, 8), NearBasis(1, 4), NearBasis(4, 4)]


def _everywhere(basis):
    """Offsets of all projector pixels that a basis touches."""
    return window_offsets(2 * (basis.reach + basis.pitch) + 1)


def test_single_pixels_are_the_papers_window():
    basis = NearBasis(5)
    np.testing.assert_array_equal(basis.offsets, window_offsets(5))
    np.testing.assert_array_equal(basis.values_at(window_offsets(5)), np.eye(25))
    assert basis.shape == (5, 5)
    assert basis.reach == 2


@pytest.mark.parametrize(("pitch", "count"), [(4, 137), (16, 153), (32, 161)])
def test_their_number_grows_with_the_logarithm_of_the_resolution(pitch, count):
    assert NearBasis(11, pitch).count == count


@pytest.mark.parametrize("basis", BASES, ids=str)
def test_each_has_a_sum_of_one_and_stays_within_the_reach(basis):
    offsets = _everywhere(basis)
    values = basis.values_at(offsets)
    np.testing.assert_allclose(values.sum(axis=0), 1.0)
    touched = np.abs(offsets[values.any(axis=1)]).max()
    # An even window reaches one function farther up and to the left.
    assert touched == basis.reach


@pytest.mark.parametrize("basis", BASES, ids=str)
def test_responses_are_sums_over_projector_pixels(basis):
    projector = Size(45, 64)
    cosines = real_basis(far_frequencies(Size(9, 64), projector)[300:], projector)
    offsets = _everywhere(basis)
    brute = cosines.patterns_at(offsets).astype(np.float64) @ basis.values_at(offsets)
    response = hat_response(cosines.cycles, basis.pitches)[cosines.index]
    np.testing.assert_allclose(
        cosines.patterns_at(basis.offsets) * response, brute, rtol=0, atol=1e-6
    )


@pytest.mark.parametrize("basis", BASES, ids=str)
def test_coefficients_from_densities_pass_through_them(basis):
    densities = np.random.default_rng(2).normal(size=basis.count)
    coefficients = basis.from_densities @ densities
    at_middles = basis.values_at(basis.offsets) @ coefficients
    np.testing.assert_allclose(at_middles * basis.pitch**2, densities, atol=1e-9)


@pytest.mark.parametrize("basis", BASES, ids=str)
def test_a_basis_is_known_by_the_shape_of_its_coefficients(basis):
    assert basis_of(basis.shape, basis.pitch) == basis


@pytest.mark.parametrize(
    ("shape", "pitch"), [((5, 4), 1), ((25,), 1), ((26,), 2), ((5, 5), 3), ((5,), 0), ((), 1)]
)
def test_a_shape_that_no_basis_has_is_refused(shape, pitch):
    with pytest.raises(ValueError, match="pitch"):
        basis_of(shape, pitch)


@pytest.mark.parametrize(("basis", "count"), [(NearBasis(5), 9), (NearBasis(1), 1)])
def test_single_pixels_next_to_q_are_three_by_three(basis, count):
    assert basis.is_next_to_q.sum() == count
    assert np.abs(basis.offsets[basis.is_next_to_q]).max() == (count > 1)


@pytest.mark.parametrize("pitch", [2, 4, 16])
def test_hats_next_to_q_are_the_finer_ones_and_the_one_at_q(pitch):
    basis = NearBasis(9, pitch)
    finer = basis.pitches < pitch
    at_q = ~basis.offsets.any(axis=1)
    np.testing.assert_array_equal(basis.is_next_to_q, finer | at_q)
