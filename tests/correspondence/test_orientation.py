"""Where q turns round."""

import numpy as np
import pytest

from nearfar.correspondence.orientation import is_mirrored


def _plane(height=14, width=18, derivative=((1.0, 0.0), (0.0, 1.0))):
    y, x = np.meshgrid(np.arange(height), np.arange(width), indexing="ij")
    return np.stack([y, x], axis=-1) @ np.array(derivative, dtype=float).T


@pytest.mark.parametrize(
    "derivative",
    [
        ((1, 0), (0, 1)),
        # A camera that is turned, finer and coarser, or whose photos are mirrored.
        ((0.3, 0.4), (-0.4, 0.3)),
        ((2.5, 0), (0.5, 3.0)),
        ((1, 0), (0, -1)),
    ],
)
def test_a_surface_is_not_turned_whatever_the_camera(derivative):
    q = _plane(derivative=derivative)
    q += 0.02 * np.random.default_rng(1).normal(size=q.shape)
    assert not is_mirrored(q).any()


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_mirrors_image_is_turned(mirrored):
    q = _plane(14, 30)
    q[:, 20:, 1] = 40 - q[:, 20:, 1]
    if mirrored:
        q = q[:, ::-1]
    found = is_mirrored(q)
    found = found[:, ::-1] if mirrored else found
    assert found[:, 21:].all()
    assert not found[:, :19].any()


def test_a_region_that_sees_one_line_alone_is_turned():
    q = _plane(14, 30)
    q[:, 22:, 1] = 22.0
    assert is_mirrored(q)[:, 23:].all()


def test_a_depth_edge_is_not_taken_for_a_turn():
    q = _plane(14, 30)
    q[:, 15:, 1] += 9.0
    assert not is_mirrored(q).any()


def test_who_has_no_neighbours_is_not_judged():
    q = _plane(14, 30)
    q[::2] = np.nan
    assert not is_mirrored(q).any()
    assert not is_mirrored(np.full((5, 6, 2), np.nan)).any()
    assert not is_mirrored(_plane(1, 9)).any()
    assert not is_mirrored(_plane(1, 1)).any()
    # The camera sees one place all over.
    assert not is_mirrored(np.full((5, 6, 2), 3.0)).any()
