"""Transports that are not direct + near + far."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.scenes.hostile import BRIGHTEST, HOSTILE, hostile_transport

PROJECTOR, CAMERA = Size(9, 11), Size(8, 7)


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_transport_is_light_and_follows_from_its_seed(name):
    one, same, other = (
        hostile_transport(name, PROJECTOR, CAMERA, seed=seed).far for seed in (0, 0, 1)
    )
    assert one.min() >= 0
    assert one.sum(axis=-1).max() == pytest.approx(BRIGHTEST)
    np.testing.assert_array_equal(one, same)
    assert np.abs(one - other).max() > 1e-4


def test_lamps_are_smooth_and_caustics_are_sharp():
    lamps, caustics = (
        hostile_transport(name, PROJECTOR, CAMERA).far[0] for name in ("lamps", "caustics")
    )

    def share_of_four_brightest(rows):
        return np.median(np.sort(rows, axis=1)[:, -4:].sum(axis=1) / rows.sum(axis=1))

    assert share_of_four_brightest(lamps) < 0.2
    assert share_of_four_brightest(caustics) > 0.4
