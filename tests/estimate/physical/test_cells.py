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


@pytest.mark.parametrize(("side", "projector"), [(1, (61, 47)), (3, (183, 141)), (4, (122, 99))])
def test_groups_are_covered_as_their_cells_are_on_average(side, projector):
    rng = np.random.default_rng(1)
    coverage = rng.uniform(size=projector)
    cell = np.stack([rng.integers(0, -(-n // side), 40) for n in projector], axis=1)
    rounded = side * cell + rng.integers(0, side, cell.shape)
    rounded = np.minimum(rounded, np.array(projector) - 1)
    found = cells.covered(coverage, rounded, side)
    assert found.shape == (40, cells.groups().max() + 1)
    for at, mine in zip(rounded // side, found, strict=True):
        means = np.zeros(len(cells.offsets()))
        for number, (y, x) in enumerate(side * (at + cells.offsets())):
            # What lies beyond the border gets no light.
            if y >= 0 and x >= 0:
                pixels = coverage[y : y + side, x : x + side]
                means[number] = pixels.mean() if pixels.size else 0.0
        expected = [means[cells.groups() == group].mean() for group in range(len(mine))]
        np.testing.assert_allclose(mine, expected, atol=1e-9)


def test_groups_sum_what_their_cells_have():
    rng = np.random.default_rng(2)
    weights, *parts = rng.normal(size=(3, len(cells.offsets()), 5))
    weights, values = weights[:, 0], parts[0] + 1j * parts[1]
    weighted, groups = weights[:, None] * values, cells.groups()
    expected = [weighted[groups == group].sum(axis=0) for group in range(groups.max() + 1)]
    np.testing.assert_allclose(cells.summed(weights, values), expected)
