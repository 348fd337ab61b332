"""Direct light of slanted footprints, on synthetic transports that are known."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.estimate.physical.elsewhere import Elsewhere
from nearfar.estimate.physical.slanted_footprints import with_slanted_footprints
from nearfar.illumination.pictures import random_pattern
from tests.estimate.physical.even import (
    CAMERA,
    PROJECTOR,
    WINDOW,
    body_of,
    places,
    split_of,
    transport_of,
)

D_FLOOR, I_FLOOR = 0.4, 0.3
# Of two boxes about a whole q, for a parallelogram one projector pixel high and one slanted: each
# is sqrt(5) / 2 wide, and a quarter off the middle.
BOX = np.sqrt(5) / 2
IN_THE_MIDDLE = (BOX / 2 + 0.25) / BOX
BESIDE = (1 - IN_THE_MIDDLE) / 2


def slanted(slant=1.0, **gap):
    """Return q that moves across, too, from one row of camera pixels to the next."""
    q = places(**gap)
    q[..., 1] += slant * np.arange(CAMERA.height)[:, None]
    return q


def transport_through(q, *, found=IN_THE_MIDDLE, beside=BESIDE, interreflection=I_FLOOR):
    """Return a transport of which a part of direct light is left on either side of q."""
    near = np.zeros((*CAMERA, 1, WINDOW, WINDOW))
    middle = WINDOW // 2
    near[..., middle, middle - 1] = near[..., middle, middle + 1] = beside * D_FLOOR
    return transport_of(np.full(CAMERA, found * D_FLOOR), np.full(CAMERA, interreflection), q, near)


@pytest.mark.parametrize("slant", [1.0, -1.0])
def test_direct_light_beside_the_projector_pixels_about_q_is_given_back(slant):
    q = slanted(slant)
    q[..., 1] += 15
    transport = transport_through(q)
    split = with_slanted_footprints(split_of(transport))
    np.testing.assert_allclose(split.direct, D_FLOOR, rtol=1e-4)
    light = random_pattern(PROJECTOR, 1)
    np.testing.assert_allclose(sum(split.components(light)), transport @ light, atol=1e-6)


@pytest.mark.parametrize(
    "q",
    [
        places(),
        # The two projector pixels about q have all of it.
        slanted() + np.array([0.0, 0.5], dtype=np.float32),
        # Little across for each row.
        slanted(0.15),
        # Not a projector pixel large: too long to be seen by one camera pixel.
        slanted(5.0),
    ],
    ids=["upright", "between two", "hardly slanted", "too long"],
)
def test_other_footprints_keep_their_direct_light(q):
    before = split_of(transport_through(q % PROJECTOR.width))
    np.testing.assert_allclose(with_slanted_footprints(before).direct, before.direct, rtol=1e-6)


def test_at_an_outline_the_side_that_goes_on_tells():
    split = with_slanted_footprints(
        split_of(transport_through(slanted(gap=6, from_column=6) + np.float32([0, 13])))
    )
    np.testing.assert_allclose(split.direct, D_FLOOR, rtol=1e-4)


def test_no_more_is_given_back_than_is_next_to_q():
    before = split_of(transport_through(slanted(), beside=0.01))
    change = with_slanted_footprints(before).direct - before.direct
    # And some light from far away that falls there.
    assert change.min() >= 0.02 * D_FLOOR
    assert change.max() <= 0.02 * D_FLOOR + 0.03 * I_FLOOR


def test_where_the_footprint_is_beyond_the_projector_nothing_is_known():
    q = slanted()
    q[..., 1] -= 20.0
    before = split_of(transport_through(q))
    after = with_slanted_footprints(before)
    assert np.isfinite(after.direct).all()
    beyond = q[..., 1] < -2
    np.testing.assert_array_equal(after.direct[beyond], before.direct[beyond])


def test_most_of_inter_reflection_stays():
    before = split_of(transport_through(slanted(), interreflection=0.02))
    change = with_slanted_footprints(before).direct - before.direct
    np.testing.assert_allclose(change, 0.3 * (0.02 + 2 * BESIDE * D_FLOOR), rtol=1e-3)


def test_direct_light_from_a_second_place_stays():
    before = split_of(transport_through(q := slanted()))
    second = Elsewhere(np.array([30]), q.reshape(-1, 2)[[60]], np.array([[0.01]]))
    both = with_slanted_footprints(replace(before, elsewhere=second))
    assert both.elsewhere is second
    # It was taken from inter-reflection, of which enough is left.
    np.testing.assert_allclose(both.direct, with_slanted_footprints(before).direct, rtol=1e-5)


def test_translucent_surfaces_keep_their_direct_light():
    q, seen = slanted(), np.zeros(CAMERA, bool)
    seen[4:9, 4:9] = True
    before = split_of(transport_through(q), body_of(seen, q, 0.2))
    change = with_slanted_footprints(before).direct - before.direct
    np.testing.assert_array_equal(change[..., 0] > 0, ~seen)
