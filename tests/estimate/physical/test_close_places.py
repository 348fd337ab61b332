"""Second places close to q, on small splits that are known."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.estimate.physical.close_places import with_close_places
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.pictures import random_pattern
from tests.estimate.physical.even import (
    CAMERA,
    PROJECTOR,
    WHITE,
    WINDOW,
    body_of,
    places,
    split_of,
    transport_of,
)

Y, X = np.mgrid[: CAMERA.height, : CAMERA.width]
# The outline is a column of camera pixels; q right of it is GAP farther than it would go on.
OUTLINE, GAP = 6, 2
AWAY = GAP + 1
OF_OTHER = 0.15
TOTAL, REST = 0.6, 0.1


def outline(*, gap=GAP, away=AWAY, other=OF_OTHER, spread=0.0, aside=False, seen=X == OUTLINE):
    """Return a split with direct light of another surface in the window of some camera pixels.

    Parameters
    ----------
    gap : int
        By which q to the right of the outline is farther.
    away : int
        From q to the other surface's light, projector pixels to the right.
    other : float
        That light.
    spread : float
        As much more is in each projector pixel up to 2 pixels from it.
    aside : bool
        Whether q of the next camera pixels is nowhere near it.
    seen : ndarray of bool, shape (Cy, Cx)
    """
    near = np.zeros((*CAMERA, 1, WINDOW, WINDOW))
    middle = WINDOW // 2
    near[seen, 0, middle, middle + away] = other
    if spread:
        for down, across in np.ndindex(WINDOW, WINDOW):
            if max(abs(down - middle), abs(across - middle - away)) <= 2:
                near[seen, 0, down, across] += spread
    q = places(gap=gap, from_column=OUTLINE + 1)
    if aside:
        q[:, OUTLINE + 1 :] = np.nan
    lost = near.sum(axis=(2, 3, 4))
    return split_of(transport_of(TOTAL - REST - lost, np.full(CAMERA, REST), q, near))


def found_in(split):
    """Return the split with close places, and which camera pixels have any."""
    found = with_close_places(split)
    seen = np.zeros(CAMERA, bool)
    seen.ravel()[found.elsewhere.pixels] = True
    return found, seen


def test_direct_light_of_the_next_camera_pixels_surface_is_direct_light_from_there():
    before = outline()
    split, seen = found_in(before)
    np.testing.assert_array_equal(seen, X == OUTLINE)
    direct, _, rest = split.components(WHITE)
    np.testing.assert_allclose(direct, TOTAL - REST, rtol=0.02)
    np.testing.assert_allclose(rest, REST, rtol=0.1)
    at_q = before.transport.correspondence[:, OUTLINE]
    np.testing.assert_allclose(split.elsewhere.places, at_q + np.array([0, AWAY]), atol=0.05)
    light = random_pattern(PROJECTOR, 1)
    np.testing.assert_allclose(sum(split.components(light)), split.transport @ light, atol=1e-6)
    for part, was in zip(split.components(light), before.components(light), strict=True):
        np.testing.assert_array_equal(part[~seen], was[~seen])


def test_a_peak_two_projector_pixels_from_q_is_found():
    _, seen = found_in(outline(gap=1, away=2))
    np.testing.assert_array_equal(seen, X == OUTLINE)


def test_where_q_goes_on_it_is_light_of_a_crease():
    """The next camera pixels see what lies between q and that place."""
    _, seen = found_in(outline(gap=0))
    assert not seen.any()


def test_a_place_that_the_next_camera_pixels_do_not_see_may_be_a_hidden_surface():
    _, seen = found_in(outline(aside=True))
    assert not seen.any()


def test_where_camera_pixels_on_one_side_have_as_much_it_is_no_outline():
    _, seen = found_in(outline(seen=(X >= OUTLINE - 3) & (X <= OUTLINE)))
    assert not seen.any()


@pytest.mark.parametrize(
    "case",
    [
        pytest.param({"other": 0.04}, id="little light"),
        pytest.param(
            {"other": 0.05, "spread": 0.01, "gap": 1, "away": 2}, id="no peak that stands alone"
        ),
        pytest.param({"away": 1, "gap": 0}, id="next to q"),
        pytest.param({"away": 0}, id="at q"),
    ],
)
def test_other_light_of_the_window_stays(case):
    before = outline(**case)
    split, seen = found_in(before)
    assert not seen.any()
    np.testing.assert_array_equal(split.direct, before.direct)


def test_bodies_and_wide_footprints_and_known_second_places_stay():
    before = outline()
    on_body = replace(before, bodies=(body_of(X == OUTLINE, before.transport.correspondence, 0.1),))
    assert not found_in(on_body)[1].any()
    known, seen = found_in(before)
    again, _ = found_in(known)
    np.testing.assert_array_equal(again.elsewhere.direct, known.elsewhere.direct)
    assert seen.sum() == len(again.elsewhere.pixels)
    wide = np.broadcast_to(np.float32([1.5, 1.5, 0, 0]), (*CAMERA, 4))
    near = np.zeros((*CAMERA, 1, NearBasis(9, 4).count), np.float32)
    transport = replace(before.transport, pitch=4, near=near, footprint=wide)
    assert not found_in(replace(before, transport=transport, footprint=wide))[1].any()


def test_no_more_than_inter_reflection_moves():
    before = outline()
    # Direct light has taken what lies there.
    richer = replace(before, direct=before.direct + 0.2 * (X == OUTLINE)[..., None])
    split, _ = found_in(richer)
    assert np.all(split.components(WHITE).interreflection >= -1e-6 - 0.2 * (X == OUTLINE))
    np.testing.assert_allclose(split.elsewhere.direct, 0.05, atol=0.01)
