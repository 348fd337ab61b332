"""Steps towards the minimum of small lasso problems."""

import numpy as np
import pytest

from nearfar.baselines import working_sets
from nearfar.baselines.working_sets import Small, relative_gap, solve_small

ROWS, PLACES, RESPONSES = 40, 12, 15


def _problem(seed=0):
    """Columns that lean on each other, so that signs change on the way."""
    generator = np.random.default_rng(seed)
    columns = generator.normal(size=(ROWS, PLACES, RESPONSES)) + 1.5
    columns /= np.linalg.norm(columns, axis=2, keepdims=True)
    responses = np.einsum("ijk,ij->ik", columns, generator.normal(size=(ROWS, PLACES)))
    penalty = np.full(ROWS, 0.02, dtype=np.float32)
    gram = np.ascontiguousarray((columns @ columns.transpose(0, 2, 1)).transpose(1, 0, 2))
    return columns, responses, gram.astype(np.float32), penalty


def _slopes(columns, responses, entries):
    residual = responses - np.einsum("ijk,ij->ik", columns, entries)
    return np.einsum("ijk,ik->ij", columns, residual), residual


def _objective(columns, responses, entries, penalty):
    _, residual = _slopes(columns, responses, entries.astype(np.float64))
    return 0.5 * (residual**2).sum(axis=1) + penalty * np.abs(entries).sum(axis=1)


@pytest.mark.parametrize("step", ["_sweep", "_newton"])
def test_no_step_raises_the_objective_and_slopes_follow(step):
    columns, responses, gram, penalty = _problem()
    entries = np.random.default_rng(1).normal(size=(ROWS, PLACES)).astype(np.float32)
    entries[:, ::3] = 0.0
    slopes, residual = _slopes(columns, responses, entries)
    slopes = slopes.astype(np.float32)
    energy = (residual**2).sum(axis=1).astype(np.float32)
    small = Small(gram, entries, slopes, penalty, energy, entries.copy(), slopes.copy())
    before = _objective(columns, responses, entries, penalty)
    signs = np.sign(entries)
    getattr(working_sets, step)(small)
    after = _objective(columns, responses, small.entries, penalty)
    assert (after <= before * (1 + 1e-5)).all()
    assert np.median(after / before) < 0.9
    follows, _ = _slopes(columns, responses, small.entries)
    np.testing.assert_allclose(small.slopes, follows, atol=2e-4)
    if step == "_newton":
        # At most one entry, which has become 0, left the signs it had.
        assert ((np.sign(small.entries) != signs).sum(axis=1) <= 1).all()
        assert (small.entries[np.sign(small.entries) != signs] == 0).all()


def test_the_gap_closes_at_the_minimum_and_bounds_the_way_there():
    columns, responses, gram, penalty = _problem()
    nothing = np.zeros((ROWS, PLACES), dtype=np.float32)
    start, residual = _slopes(columns, responses, nothing)
    energy = (residual**2).sum(axis=1).astype(np.float32)
    tolerances = np.full(ROWS, 1e-4)

    def gap_of(entries):
        slopes, residual = _slopes(columns, responses, entries)
        return relative_gap(entries, slopes, (residual**2).sum(axis=1), penalty)

    found = solve_small(gram, nothing, start.astype(np.float32), penalty, energy, tolerances)
    assert (gap_of(found) < 1.2e-4).all()
    least = _objective(columns, responses, found, penalty)
    for share in (0.0, 0.5, 0.9, 1.1):
        objective = _objective(columns, responses, share * found, penalty)
        assert ((objective - least) / objective <= gap_of(share * found) + 1e-5).all()
