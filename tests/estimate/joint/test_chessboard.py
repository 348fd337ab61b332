"""Sweeps over every other camera pixel."""

from types import SimpleNamespace

import numpy as np

from nearfar.arrays import Size
from nearfar.estimate.joint.chessboard import every_choice, part_of_sweep
from nearfar.estimate.joint.problem import ComponentChoice
from nearfar.priors.fitted import LIT_AT_PITCH, LIT_COMPONENTS

UNLIT = len(LIT_COMPONENTS)


def test_odd_fields_have_the_choice_of_a_camera_pixel_beside_them_that_is_lit_alike():
    camera = Size(3, 4)
    is_even = np.indices(camera).sum(axis=0).ravel() % 2 == 0
    component = np.zeros(camera.pixels, dtype=np.int64)
    component[is_even] = [3, 18, UNLIT + 1, 2, 13, 20]
    scale = np.where(is_even, np.arange(camera.pixels), 0.0).astype(np.float32)
    lit = np.ones(camera.pixels, dtype=bool)
    # Of the even fields that which is dark, and beside it the odd fields (1, 0) and (0, 1).
    lit[[5, 4, 1]] = False
    found = every_choice(ComponentChoice(component, scale), is_even, lit, camera)
    np.testing.assert_array_equal(found.prior_component[is_even], component[is_even])
    rows = found.prior_component.reshape(camera)
    assert rows[0].tolist() == [3, UNLIT + 1, 18, 18]
    assert rows[1].tolist() == [UNLIT + 1, UNLIT + 1, 18, 2]
    assert rows[2].tolist() == [13, 13, 20, 20]
    assert (found.prior_scale[1:] > 0).all()


def test_a_camera_pixel_that_is_lit_like_none_beside_it_has_a_component_of_its_kind():
    camera = Size(1, 4)
    is_even = np.array([True, False, True, False])
    dark = ComponentChoice(np.array([UNLIT, 0, UNLIT, 0]), np.float32([0.5, 0.0, 0.25, 0.0]))
    lit = np.array([False, True, False, True])
    found = every_choice(dark, is_even, lit, camera)
    assert found.prior_component.tolist() == [UNLIT, LIT_AT_PITCH[0], UNLIT, LIT_AT_PITCH[0]]
    assert found.prior_scale.tolist() == [0.5, 0.5, 0.25, 0.25]


def test_each_colour_of_a_chessboard_is_shifted_twice():
    camera = Size(4, 5)
    is_even = np.indices(camera).sum(axis=0).ravel() % 2 == 0
    problem = SimpleNamespace(
        pixels=SimpleNamespace(is_even=is_even), measurements=SimpleNamespace(camera=camera)
    )
    shifts = np.zeros(camera.pixels, dtype=np.int64)
    for number in range(5):
        part = part_of_sweep(problem, number)
        shifts[part.selected] += part.moves_q
    assert shifts.tolist() == [2] * camera.pixels
