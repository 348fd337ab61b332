"""Outlines of opaque surfaces, on small splits that are known."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar import split_physically
from nearfar.estimate.physical.elsewhere import Elsewhere
from nearfar.estimate.physical.opaque_outlines import with_opaque_outlines
from nearfar.illumination.pictures import random_pattern
from tests.estimate.physical.even import (
    CAMERA,
    PROJECTOR,
    WHITE,
    body_of,
    of_both_channels,
    places,
    split_of,
    transport_of,
)

Y, X = np.mgrid[: CAMERA.height, : CAMERA.width]
# The outline is a column of camera pixels between two surfaces, whose q is GAP apart.
OUTLINE, GAP = 6, 6
# Direct light and inter-reflection of both.
NEARER, FARTHER = (0.6, 0.1), (0.2, 0.05)
NOWHERE = np.zeros(CAMERA, bool)


def two_surfaces(*, weight=0.5, gap=GAP, nearer=NEARER, farther=FARTHER, lost=True, more=0.0):
    """Return a split whose outline sees a share of the nearer surface, and the rest of the other.

    Direct light of the farther one is taken for inter-reflection there, if it is lost. There may be
    more inter-reflection than both have.
    """
    light = [np.where(X < OUTLINE, one, other) for one, other in zip(nearer, farther, strict=True)]
    direct, rest = light
    direct[:, OUTLINE] = weight * nearer[0]
    rest[:, OUTLINE] = weight * nearer[1] + (1 - weight) * farther[1] + more
    (rest if lost else direct)[:, OUTLINE] += (1 - weight) * farther[0]
    return split_of(transport_of(direct, rest, places(gap=gap, from_column=OUTLINE + 1)))


def found_in(split, creases=NOWHERE):
    """Return the split with its outlines, and which camera pixels have direct light elsewhere."""
    found = with_opaque_outlines(split, creases)
    seen = np.zeros(CAMERA, bool)
    seen.ravel()[found.elsewhere.pixels] = True
    return found, seen


@pytest.mark.parametrize("weight", [0.35, 0.5, 0.65])
def test_direct_light_of_the_other_surface_is_found(weight):
    found, seen = found_in(two_surfaces(weight=weight))
    np.testing.assert_array_equal(seen, X == OUTLINE)
    direct, _, rest = found.components(WHITE)
    expected = [
        weight * one + (1 - weight) * other for one, other in zip(NEARER, FARTHER, strict=True)
    ]
    np.testing.assert_allclose(direct[:, OUTLINE], expected[0], atol=1e-6)
    np.testing.assert_allclose(rest[:, OUTLINE], expected[1], atol=1e-6)
    others = X != OUTLINE
    np.testing.assert_allclose(direct[others], np.where(X < OUTLINE, 0.6, 0.2)[others], atol=1e-6)


def test_it_comes_from_where_the_other_surface_lies():
    split = two_surfaces()
    found, _ = found_in(split)
    q = split.transport.correspondence[:, OUTLINE]
    np.testing.assert_allclose(found.elsewhere.places, q + np.array([0.0, GAP]), atol=1e-5)
    light = np.zeros(PROJECTOR, np.float32)
    light[:, int(q[0, 1]) + GAP] = 1.0
    np.testing.assert_allclose(found.components(light).direct[:, OUTLINE], 0.1, atol=1e-6)


def test_where_q_lies_on_the_farther_surface_light_comes_from_the_nearer_one():
    split = two_surfaces(nearer=FARTHER, farther=NEARER)
    # q of the outline is that of the surface on its right.
    q = split.transport.correspondence.copy()
    q[:, OUTLINE, 1] += GAP
    moved = replace(split, transport=replace(split.transport, correspondence=q))
    found, seen = found_in(moved)
    np.testing.assert_array_equal(seen, X == OUTLINE)
    np.testing.assert_allclose(
        found.elsewhere.places, q[:, OUTLINE] - np.array([0.0, GAP]), atol=1e-5
    )


def test_the_sum_stays_as_it_is():
    found, _ = found_in(two_surfaces())
    for light in (WHITE, random_pattern(PROJECTOR, 1)):
        total = sum(found.components(light))
        np.testing.assert_allclose(total, found.transport @ light, atol=1e-6)


@pytest.mark.parametrize(
    "split",
    [
        two_surfaces(gap=1),  # q goes on: a crease, or a step of texture
        two_surfaces(weight=0.8),  # hardly anything of the other
        two_surfaces(weight=0.2),
        two_surfaces(lost=False),  # nothing was taken for inter-reflection
        two_surfaces(more=0.5),  # brighter than either side
        two_surfaces(nearer=(0.9, 0.1), farther=(0.1, 0.4)),  # one side has a larger share
    ],
)
def test_what_is_no_such_outline_stays_as_it_is(split):
    _, seen = found_in(split)
    assert not seen.any()


def test_creases_bodies_shadows_and_second_places_stay_as_they_are():
    split = two_surfaces()
    above = Y < 4
    _, seen = found_in(split, above)
    np.testing.assert_array_equal(seen, (X == OUTLINE) & ~above)
    told = Elsewhere(np.flatnonzero(above & (X == OUTLINE)), np.zeros((4, 2)), np.zeros((4, 1)))
    found, _ = found_in(replace(split, elsewhere=told))
    np.testing.assert_allclose(found.elsewhere.places[:4], 0.0)
    body = body_of(X < OUTLINE, places(), 0.3)
    _, seen = found_in(replace(split, bodies=(body,)))
    assert not seen.any()
    q = split.transport.correspondence.copy()
    q[:, OUTLINE + 1 :] = np.nan
    _, seen = found_in(replace(split, transport=replace(split.transport, correspondence=q)))
    assert not seen.any()


def test_camera_pixels_that_see_several_projector_pixels_stay_as_they_are():
    for width, is_found in ((1.0, True), (2.0, False)):
        _, seen = found_in(replace(two_surfaces(), footprint=np.full((*CAMERA, 4), width)))
        assert seen.any() == is_found


def test_places_stay_on_the_projector():
    split = two_surfaces()
    q = split.transport.correspondence.copy()
    # The surface on the right begins at the projector's border, that on the left lies beyond it.
    q[:, OUTLINE + 1 :, 1] = np.arange(CAMERA.width - OUTLINE - 1)
    q[:, : OUTLINE + 1, 1] = 20 + np.arange(OUTLINE + 1)
    found, seen = found_in(replace(split, transport=replace(split.transport, correspondence=q)))
    np.testing.assert_array_equal(seen, X == OUTLINE)
    np.testing.assert_allclose(found.elsewhere.places[:, 1], 0.0)


@pytest.mark.parametrize("upright", [True, False])
def test_outlines_two_camera_pixels_wide_are_mixtures_of_what_lies_beyond(upright):
    # From left to right: the nearer surface, two thirds and one third of it, the farther one.
    weight = np.clip((OUTLINE + 2 - X) / 3, 0.0, 1.0)
    direct, rest = (
        weight * one + (1 - weight) * other for one, other in zip(NEARER, FARTHER, strict=True)
    )
    at_q = np.where(X <= OUTLINE + 1, weight * NEARER[0], direct)
    q = places(gap=GAP, from_column=OUTLINE + 2)
    pictures = [at_q, direct + rest - at_q, q]
    if not upright:
        pictures = [np.swapaxes(picture, 0, 1) for picture in pictures]
        direct = direct.T
    found, seen = found_in(split_of(transport_of(*pictures)))
    assert seen.sum() == 2 * CAMERA.height
    np.testing.assert_allclose(found.components(WHITE).direct, direct, atol=1e-6)


def of_two_channels(one, other):
    """Return a split of the channels of two."""
    return split_of(of_both_channels(one.transport, other.transport))


def test_colours_that_no_mixture_has_are_of_something_else():
    alike = two_surfaces(weight=0.5)
    found, seen = found_in(of_two_channels(alike, alike))
    np.testing.assert_array_equal(seen, X == OUTLINE)
    assert found.components(WHITE).direct.shape == (*CAMERA, 2)
    _, seen = found_in(of_two_channels(alike, two_surfaces(nearer=FARTHER, farther=NEARER)))
    np.testing.assert_array_equal(seen, X == OUTLINE)
    brighter = two_surfaces(farther=NEARER, lost=False, more=0.3)
    _, seen = found_in(of_two_channels(alike, brighter))
    assert not seen.any()


def test_no_direct_light_is_below_zero():
    # In one channel there is less inter-reflection than in the mixture, in the other much more.
    split = of_two_channels(two_surfaces(), two_surfaces(lost=False, more=-0.02))
    found, seen = found_in(split)
    np.testing.assert_array_equal(seen, X == OUTLINE)
    assert found.elsewhere.direct.min() == 0.0


def test_a_transport_is_split_with_them():
    split = split_physically(two_surfaces().transport)
    np.testing.assert_array_equal(split.elsewhere.pixels, np.flatnonzero(X == OUTLINE))
