"""Correspondence from captures of anybody's patterns."""

import numpy as np

from nearfar.arrays import Size
from nearfar.workflow.by_codes import correspond_by_codes
from tests.shown import captured, cornell, fringes, gray_code, white_and_black, with_inverses


def test_camera_pixels_that_see_many_projector_pixels_have_q(tmp_path):
    projector = Size(32, 48)
    world = cornell(projector, Size(8, 8))
    pictures = [
        *(bit for axis in (0, 1) for bit in with_inverses(gray_code(projector, axis))),
        *white_and_black(projector),
    ]
    found = correspond_by_codes(captured(world, pictures, tmp_path)).correspondence.q
    is_found = np.isfinite(found).all(axis=-1) & world.lit
    assert is_found.sum() > 0.9 * world.lit.sum()
    off = np.abs(found - world.correspondence)[is_found]
    assert np.median(off) < 0.2
    assert off.max() < 1.5


def test_light_of_fringes_that_were_raised_to_a_power_is_sinusoidal(tmp_path):
    projector, power = Size(8, 96), 1 / 2.2
    world = cornell(projector, Size(6, 8))
    raised = fringes(projector, 1, [96.0, 24.0], 4, power)
    capture = captured(world, [*raised, *white_and_black(projector)], tmp_path, noise=False)
    plain = fringes(projector, 1, [96.0, 24.0], 4)
    for number, pattern in enumerate(plain):
        np.testing.assert_allclose(capture.pattern(number), pattern / 255, atol=0.02)
