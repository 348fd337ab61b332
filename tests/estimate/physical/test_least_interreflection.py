"""Bodies whose inter-reflection is far below the body's own, on synthetic transports."""

import numpy as np
import pytest

from nearfar.estimate.physical.least_interreflection import with_least_interreflection
from nearfar.illumination.pictures import random_pattern
from tests.estimate.physical.even import (
    CAMERA,
    PROJECTOR,
    WHITE,
    body_of,
    places,
    split_of,
    transport_of,
)

D_WAX, S_WAX, I_WAX = 0.15, 0.35, 0.1
TOTAL = D_WAX + S_WAX + I_WAX
SPOT = (slice(5, 8), slice(4, 6))
SEEN = np.ones(CAMERA, bool)


def wax(left, *, direct=D_WAX):
    """Return a split of wax whose inter-reflection is given in a spot; the light is the same."""
    subsurface, of_direct = np.full(CAMERA, S_WAX), np.full(CAMERA, D_WAX)
    of_direct[SPOT] = direct
    subsurface[SPOT] = TOTAL - direct - left
    transport = transport_of(of_direct, TOTAL - of_direct, places())
    return split_of(transport, body_of(SEEN, places(), subsurface))


def under_white(split):
    return [np.reshape(part, CAMERA) for part in split.components(WHITE)]


@pytest.mark.parametrize("left", [0.02, 0.0, -0.1])
def test_a_dark_spot_gets_three_tenths_of_the_bodys_inter_reflection(left):
    before = wax(left)
    split = with_least_interreflection(before)
    direct, subsurface, interreflection = under_white(split)
    np.testing.assert_allclose(direct, D_WAX, atol=1e-6)
    np.testing.assert_allclose(interreflection[SPOT], 0.3 * I_WAX, rtol=1e-4)
    np.testing.assert_allclose(subsurface[SPOT], TOTAL - D_WAX - 0.3 * I_WAX, rtol=1e-4)
    elsewhere = np.ones(CAMERA, bool)
    elsewhere[SPOT] = False
    np.testing.assert_allclose(interreflection[elsewhere], I_WAX, rtol=1e-4)
    light = random_pattern(PROJECTOR, 1)
    np.testing.assert_allclose(sum(split.components(light)), split.transport @ light, atol=1e-6)


def test_three_tenths_and_more_stay():
    before = wax(0.035)
    after = with_least_interreflection(before)
    np.testing.assert_array_equal(after.bodies[0].amplitude, before.bodies[0].amplitude)


def test_no_more_than_all_subsurface_light_is_given_up():
    direct = TOTAL + 0.1
    split = with_least_interreflection(wax(TOTAL - direct - 0.01, direct=direct))
    of_direct, subsurface, interreflection = under_white(split)
    np.testing.assert_allclose(of_direct[SPOT], direct, rtol=1e-5)
    np.testing.assert_allclose(subsurface[SPOT], 0.0, atol=1e-7)
    np.testing.assert_allclose(interreflection[SPOT], TOTAL - direct, rtol=1e-4)


def test_a_split_without_bodies_stays_as_it_is():
    before = split_of(transport_of(np.full(CAMERA, 0.5), np.full(CAMERA, 0.1), places()))
    np.testing.assert_array_equal(with_least_interreflection(before).direct, before.direct)
