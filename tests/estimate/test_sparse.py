"""Equation (10) for all pixels at once, against solvers of one pixel."""

import numpy as np
import pytest
from scipy.optimize import linprog

from nearfar.arrays import Size
from nearfar.estimate.matrices import build_matrices
from nearfar.estimate.sparse import least_risk, solve
from tests.estimate.bayesian import solve_bayesian
from tests.worlds import ideal_measurements, model_transport


def _problem(window=7, dropped=Size(3, 3), rows=12, noise=0.0, seed=0, clipped=False):
    projector = Size(4 * window, 4 * window)
    world = model_transport(projector, Size(2, 2), window=window, far=Size(3, 3))
    matrices = build_matrices(
        ideal_measurements(world, window, Size(3, 3), dropped), window, Size(3, 3), dropped
    )
    generator = np.random.default_rng(seed)
    n = np.zeros((rows, window**2))
    inside = np.ones(n.shape, dtype=bool)
    if clipped:
        inside[:, : 2 * window] = False
    for row, where in zip(n, inside, strict=True):
        row[generator.choice(np.flatnonzero(where), 5, replace=False)] = generator.uniform(
            0.3, 1, 5
        )
    unseen = matrices.unseen
    shaken = n + generator.normal(0, noise, n.shape)
    n0 = shaken - (shaken @ unseen) @ unseen.T
    return n, n0.astype(np.float32), unseen, inside


def test_the_matrices_split_the_window_in_seen_and_unseen():
    for window, dropped in ((7, Size(3, 3)), (7, Size(1, 3)), (8, Size(3, 1)), (9, Size(1, 1))):
        projector = Size(30, 31)
        world = model_transport(projector, Size(2, 2), window=window, far=Size(3, 3))
        matrices = build_matrices(
            ideal_measurements(world, window, Size(3, 3), dropped), window, Size(3, 3), dropped
        )
        unseen, patterns = matrices.unseen, matrices.near.on_window
        assert unseen.shape[1] == dropped.pixels
        np.testing.assert_allclose(unseen.T @ unseen, np.eye(dropped.pixels), atol=1e-5)
        np.testing.assert_allclose(patterns @ unseen, 0, atol=1e-3)
        # Equation (5): what is seen is inverted by a scaled transpose.
        seen = np.eye(window**2) - unseen @ unseen.T
        if window % 2 == 0:
            checkerboard = matrices.checkerboard.on_window[0] / window
            seen -= np.outer(checkerboard, checkerboard)
        np.testing.assert_allclose(patterns.T @ matrices.near_inverse, seen, atol=1e-5)


@pytest.mark.parametrize("dropped", [Size(1, 1), Size(3, 3)])
@pytest.mark.parametrize("clipped", [False, True])
def test_without_noise_it_is_the_linear_program(dropped, clipped):
    n, n0, unseen, inside = _problem(dropped=dropped, clipped=clipped)
    found, _ = solve(n0, unseen, inside, np.zeros(len(n0), np.float32))
    np.testing.assert_allclose(found, n, atol=2e-5)
    if clipped:
        return
    # min sum |n0 + Z z|, as a linear program, gives the same least sum.
    z, slack = unseen.astype(float), np.eye(n0.shape[1])
    for row, mine in zip(n0.astype(float), found, strict=True):
        program = linprog(
            np.concatenate([np.zeros(unseen.shape[1]), np.ones(len(slack))]),
            A_ub=np.block([[z, -slack], [-z, -slack]]),
            b_ub=np.concatenate([-row, row]),
            bounds=[(None, None)] * unseen.shape[1] + [(0, None)] * len(slack),
        )
        assert program.status == 0
        assert np.abs(mine).sum() == pytest.approx(program.fun, rel=1e-4)


@pytest.mark.parametrize("dropped", [Size(1, 1), Size(3, 3)])
def test_with_noise_it_is_the_lasso(dropped):
    # Imported here: it takes seconds, in each process that collects tests.
    from sklearn.linear_model import Lasso

    _, n0, unseen, inside = _problem(dropped=dropped, noise=0.05)
    threshold = 0.06
    found, _ = solve(n0, unseen, inside, np.full(len(n0), threshold, np.float32))
    seen = np.eye(len(unseen)) - unseen.astype(float) @ unseen.T
    size = n0.shape[1]
    lasso = Lasso(alpha=threshold / size, fit_intercept=False, tol=1e-10, max_iter=100_000)

    def objective(row, n):
        return 0.5 * np.sum((row - seen @ n) ** 2) + threshold * np.abs(n).sum()

    for row, mine in zip(n0.astype(float), found.astype(float), strict=True):
        theirs = lasso.fit(seen, row).coef_
        assert objective(row, mine) <= objective(row, theirs) * (1 + 1e-4)
        np.testing.assert_allclose(mine, theirs, atol=0.01)


def test_the_residual_stays_within_the_noise():
    # lambda at the noise of an entry or less: the residual is at most epsilon.
    noise = 0.05
    _, n0, unseen, inside = _problem(noise=noise, rows=40)
    found, _ = solve(n0, unseen, inside, np.full(len(n0), noise, np.float32))
    seen = found - (found @ unseen) @ unseen.T
    residual = np.sum((n0 - seen) ** 2, axis=1)
    assert np.all(residual <= noise**2 * n0.shape[1] * 1.0001)


def test_it_is_about_as_good_as_the_papers_bayesian_solver():
    noise = 0.05
    n, n0, unseen, inside = _problem(noise=noise, rows=30, seed=4)
    batched, _ = solve(n0, unseen, inside, np.full(len(n0), 0.75 * noise, np.float32))
    bayesian = solve_bayesian(n0, unseen, inside, np.full(len(n0), noise))

    def error(found):
        return np.sqrt(np.mean((found - n) ** 2)) / noise

    assert error(n0) > 1
    assert error(bayesian) < 0.8
    assert error(batched) < 1.25 * error(bayesian)
    # And they agree with each other to less than the noise.
    assert np.sqrt(np.mean((batched - bayesian) ** 2)) < 0.5 * noise


def test_the_bayesian_reference_agrees_with_a_library():
    from sklearn.linear_model import ARDRegression

    noise = 0.05
    n, n0, unseen, inside = _problem(noise=noise, rows=4, seed=5, dropped=Size(1, 1))
    mine = solve_bayesian(n0, unseen, inside, np.full(len(n0), noise))
    seen = np.eye(len(unseen)) - unseen.astype(float) @ unseen.T
    theirs = np.stack(
        [ARDRegression(fit_intercept=False, max_iter=300).fit(seen, row).coef_ for row in n0]
    )
    mine_error, their_error = (np.linalg.norm(found - n) for found in (mine, theirs))
    assert mine_error < 1.1 * their_error
    assert np.linalg.norm(mine - theirs) < 0.25 * np.linalg.norm(n)


def test_entries_beyond_the_border_stay_zero():
    _, n0, unseen, inside = _problem(noise=0.05, clipped=True)
    found, _ = solve(n0, unseen, inside, np.full(len(n0), 0.05, np.float32))
    assert np.all(found[~inside] == 0)
    assert np.all(solve_bayesian(n0, unseen, inside, np.full(len(n0), 0.05))[~inside] == 0)


def test_a_window_of_zeros_stays_zero():
    _, n0, unseen, inside = _problem()
    found, z = solve(0 * n0, unseen, inside, np.zeros(len(n0), np.float32))
    assert np.all(found == 0)
    assert np.all(np.isfinite(z))


def test_lambda_suits_the_window():
    generator = np.random.default_rng(6)
    noise = np.full(400, 0.1, dtype=np.float32)
    empty = 0.1 * generator.normal(size=(400, 121)).astype(np.float32)
    full = empty + generator.uniform(0.05, 0.5, size=empty.shape).astype(np.float32)
    inside = np.ones(empty.shape, dtype=bool)
    cleared = least_risk(empty, inside, noise)
    kept = least_risk(full, inside, noise)
    assert np.median(cleared) >= 0.15
    assert np.median(kept) <= 0.025

    def error(v, truth, threshold):
        n = np.sign(v) * np.maximum(np.abs(v) - threshold[:, None], 0)
        return np.mean((n - truth) ** 2)

    # No one share serves both.
    assert error(full, full - empty, kept) < 1.05 * error(full, full - empty, 0.125 * noise)
    assert error(full, full - empty, kept) < 0.5 * error(full, full - empty, 2 * noise)
    assert error(empty, 0, cleared) < 0.1 * error(empty, 0, 0.125 * noise)
    # What lies beyond the border has no say.
    half = inside.copy()
    half[:, 60:] = False
    spoiled = np.where(half, empty, 5.0).astype(np.float32)
    np.testing.assert_array_equal(
        least_risk(spoiled, half, noise), least_risk(np.where(half, empty, 0), half, noise)
    )
