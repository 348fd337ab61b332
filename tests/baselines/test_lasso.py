"""The lasso for many rows: a library's minimum, and conditions that only the minimum meets."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.baselines.haar import haar
from nearfar.baselines.lasso import highest_penalty, refit, solve, start
from nearfar.baselines.random_patterns import bernoulli_patterns
from nearfar.baselines.sensing import sense

PROJECTOR = Size(13, 18)
ROWS = 8


def _problem(count=90, seed=0):
    """Rows of a spike on something smooth, and what random patterns see of them."""
    generator = np.random.default_rng(seed)
    y, x = np.indices(PROJECTOR)
    smooth = np.cos(y / 9.0 + generator.uniform(0, 6, (ROWS, 1, 1))) * np.cos(x / 7.0)
    rows = 0.05 * (1 + smooth) + 0.003 * generator.random((ROWS, *PROJECTOR))
    rows.reshape(ROWS, -1)[np.arange(ROWS), generator.integers(0, PROJECTOR.pixels, ROWS)] += 1
    rows = rows.reshape(ROWS, -1).astype(np.float32)
    patterns = bernoulli_patterns(PROJECTOR, count, seed)
    sensing = sense(patterns)
    responses, along = sensing.project(rows @ patterns.reshape(count, -1).T.astype(np.float32))
    return rows, patterns, sensing, responses, along


def _objective(sensing, responses, coefficients, penalty):
    coefficients = coefficients.astype(np.float64)
    residual = responses - coefficients @ sensing.columns
    return 0.5 * (residual**2).sum(axis=1) + penalty * np.abs(coefficients).sum(axis=1)


@pytest.mark.parametrize("share", [0.3, 0.03, 0.003])
def test_it_finds_a_librarys_minimum(share):
    # Imported here: it takes seconds, in each process that collects tests.
    from sklearn.linear_model import Lasso

    _, patterns, sensing, responses, _ = _problem()
    penalty = share * highest_penalty(start(sensing.columns, responses))
    found = solve(sensing.columns, responses, penalty, tolerance=1e-5)
    oracle = np.zeros_like(found)
    for i in range(ROWS):
        # scikit-learn divides the squares by their number.
        lasso = Lasso(
            alpha=float(penalty[i]) / len(patterns),
            fit_intercept=False,
            tol=1e-6,
            max_iter=200_000,
        )
        lasso.fit(sensing.columns[:-1].T.astype(np.float64), responses[i].astype(np.float64))
        oracle[i, :-1] = lasso.coef_
    ours = _objective(sensing, responses, found, penalty)
    theirs = _objective(sensing, responses, oracle, penalty)
    np.testing.assert_allclose(ours, theirs, rtol=1e-4)
    size = np.linalg.norm(oracle, axis=1)
    assert (np.linalg.norm(found - oracle, axis=1) < 0.01 * size).all()


def test_every_tolerance_is_kept():
    _, _, sensing, responses, _ = _problem()
    penalty = 0.01 * highest_penalty(start(sensing.columns, responses))
    best = _objective(
        sensing, responses, solve(sensing.columns, responses, penalty, tolerance=1e-5), penalty
    )
    for tolerance in (1e-1, 1e-2, 1e-3, 1e-4):
        found = solve(sensing.columns, responses, penalty, tolerance)
        assert (_objective(sensing, responses, found, penalty) <= best * (1 + tolerance)).all()


def test_a_row_does_not_depend_on_its_company():
    _, _, sensing, responses, _ = _problem()
    penalty = 0.02 * highest_penalty(start(sensing.columns, responses))
    together = solve(sensing.columns, responses, penalty, tolerance=1e-5)
    for i in range(ROWS):
        alone = solve(sensing.columns, responses[i : i + 1], penalty[i : i + 1], tolerance=1e-5)
        assert np.linalg.norm(alone - together[i]) < 2e-3 * np.linalg.norm(together[i])


def test_above_the_highest_strength_nothing_is_left():
    _, _, sensing, responses, _ = _problem()
    highest = highest_penalty(start(sensing.columns, responses))
    assert not solve(sensing.columns, responses, 1.001 * highest).any()
    assert solve(sensing.columns, responses, 0.9 * highest).any(axis=1).all()


def test_refitting_is_least_squares_on_the_support():
    _, _, sensing, responses, _ = _problem()
    penalty = 0.1 * highest_penalty(start(sensing.columns, responses))
    found = solve(sensing.columns, responses, penalty)
    counts = np.count_nonzero(found, axis=1)
    most = int(np.sort(counts)[ROWS // 2])
    fitted = refit(sensing.columns, responses, found, most)
    assert (counts > most).any()
    for i in range(ROWS):
        expected = found[i].copy()
        if counts[i] <= most:
            kept = np.flatnonzero(found[i])
            expected[kept] = np.linalg.lstsq(sensing.columns[kept].T, responses[i], rcond=None)[0]
        np.testing.assert_allclose(fitted[i], expected, atol=2e-5)


def test_the_mean_is_not_penalised():
    rows, patterns, sensing, responses, along = _problem()
    penalty = 0.05 * highest_penalty(start(sensing.columns, responses))
    found = sensing.pictures(solve(sensing.columns, responses, penalty, tolerance=1e-5), along)
    # Of the whole problem, its column of the means included: no overlap is left with the mean's
    # column, lambda with a wavelet in use, and no more with any other.
    lights = patterns.reshape(len(patterns), -1).astype(np.float64)
    residual = (rows - found.reshape(ROWS, -1)) @ lights.T / sensing.scale
    matrix = haar(patterns.astype(np.float64)).reshape(len(patterns), -1) / sensing.scale
    overlap = residual @ matrix
    used = np.abs(haar(found).reshape(ROWS, -1)) > 1e-4
    used[:, 0] = False
    assert np.abs(overlap[:, 0] / np.linalg.norm(matrix[:, 0])).max() < 1e-4 * penalty.max()
    assert (np.abs(overlap[:, 1:]) < 1.01 * penalty[:, None]).all()
    assert used.any(axis=1).all()
    least = np.where(used, np.abs(overlap), np.inf).min(axis=1)
    assert (least > 0.99 * penalty).all()
