"""Cells about q, and groups of those that are far from it."""

import numpy as np
import pytest

from nearfar.estimate.physical import cells


def test_each_cell_near_q_counts_by_itself_and_those_far_away_as_neighbours():
    groups, offsets = cells.groups(), cells.offsets()
    assert np.array_equal(np.unique(groups), np.arange(groups.max() + 1))
    for group in range(groups.max() + 1):
        mine = offsets[groups == group]
        height, width = np.ptp(mine, axis=0) + 1
        assert len(mine) == height * width
        if np.abs(mine).max() <= cells.SINGLE_REACH:
            assert len(mine) == 1
        else:
            assert np.abs(mine).max(axis=1).min() > cells.SINGLE_REACH
            assert len(mine) <= 6


@pytest.mark.parametrize("side", [1, 3])
def test_groups_sum_what_cells_have_and_what_covers_them(side):
    rng = np.random.default_rng(1)
    projector = np.array([61, 47]) * side
    values = rng.normal(size=(len(cells.offsets()), 5)) + 1j
    rounded = np.stack([side * rng.integers(0, n // side, 40) for n in projector], axis=1)
    # What lies beyond the border gets no light.
    inside = rounded[:, None] + side * cells.offsets()
    inside = np.all((inside >= 0) & (inside < projector), axis=-1)
    everywhere = cells.covered(np.ones(projector), rounded, side)
    half = 0.5 * np.ones(projector)
    np.testing.assert_allclose(cells.covered(half, rounded, side), 0.5 * everywhere)
    whole = inside.all(axis=1)
    assert 0 < np.count_nonzero(whole) < len(whole)
    found = everywhere[whole] @ cells.summed(values)
    np.testing.assert_allclose(found, inside[whole] @ values)
    # A border cuts groups, whose cells then count alike.
    of_groups = np.stack(
        [inside[:, cells.groups() == g].mean(axis=1) for g in range(cells.groups().max() + 1)],
        axis=1,
    )
    np.testing.assert_allclose(everywhere, of_groups)
