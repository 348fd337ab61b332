"""What rounded patterns add to responses is known where frequencies were measured."""

import numpy as np

from nearfar.arrays import Size
from nearfar.illumination.real_basis import MOST_HELD, real_basis
from nearfar.photometry.measure import measured_basis
from nearfar.photometry.quantisation import quantisation_error, without_quantisation
from nearfar.plan import choose_plan, paper_plan

PROJECTOR = Size(16, 12)


def _basis():
    return measured_basis(choose_plan(PROJECTOR, 80, checks=0)[0])[0]


def _rows(generator):
    return generator.uniform(size=(7, 2, PROJECTOR.pixels)).astype(np.float32)


def test_light_at_measured_frequencies_answers_as_to_ideal_waves():
    basis = _basis()
    rows = _rows(np.random.default_rng(0))
    rows = basis.synthesise(rows @ basis.patterns.T)
    ideal = rows @ basis.patterns.T
    rounded = ideal + rows @ quantisation_error(basis).T
    found, _ = without_quantisation(basis, rounded)
    before, after = (np.abs(each - ideal).max() for each in (rounded, found))
    assert before > 3e-2
    # Of second order in errors of up to 1/255.
    assert after < before / 255


def test_what_is_left_of_the_errors_is_what_other_light_answers():
    basis = _basis()
    rows = _rows(np.random.default_rng(1))
    ideal = rows @ basis.patterns.T
    error = quantisation_error(basis)
    assert 0.001 < np.abs(error).max() <= 1 / 255 + 1e-6
    answers = rows @ error.T
    found, left = without_quantisation(basis, ideal + answers)
    assert np.abs(rows @ left.T).max() > 0.1 * np.abs(answers).max()
    # The answers are themselves read through rounded patterns.
    second_order = 2 / 255 * np.abs(answers).max()
    np.testing.assert_allclose(found, ideal + rows @ left.T, atol=second_order)
    np.testing.assert_allclose(basis.analyse(left), 0.0, atol=2e-6)


def test_frequencies_off_the_dft_grid_are_left_alone():
    basis, _ = measured_basis(paper_plan(Size(16, 20), 5, Size(3, 3)))
    off_grid = np.array([(k.fy * 16).denominator > 1 for k in basis.frequencies])[basis.index]
    assert off_grid.any()
    only = np.broadcast_to(off_grid, (2, 1, basis.count)).astype(np.float32)
    found, _ = without_quantisation(basis, only)
    np.testing.assert_array_equal(found, only)


def test_errors_that_are_not_held_change_nothing():
    side = int(np.sqrt(MOST_HELD)) + 1
    basis = real_basis(_basis().frequencies[:1], Size(side, side))
    responses = np.ones((3, 1, basis.count), dtype=np.float32)
    found, left = without_quantisation(basis, responses)
    assert found is responses
    assert left.shape == (basis.count, 0)
