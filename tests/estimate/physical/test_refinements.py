"""Outlines, specks and holes of a physical split, on synthetic transports that are known."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.estimate.physical.elsewhere import Elsewhere
from nearfar.estimate.physical.holes import without_holes
from nearfar.estimate.physical.mixtures import BODY_AT_Q
from nearfar.estimate.physical.outlines import with_outlines
from nearfar.estimate.physical.specks import without_specks
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

OF_BODY = 0.6
OUTLINE = 6
D_BODY, S_BODY, I_BODY = 0.15, 0.35, 0.05
D_WALL, I_WALL = 0.5, 0.1


def wax_before_a_wall(gap):
    """Return a split at whose outline, a column, camera pixels see wax and wall; q is the wall's.

    Left of it is wax, right of it a wall whose places on the projector are a gap away.
    """
    x = np.tile(np.arange(CAMERA.width), (CAMERA.height, 1))
    of_body = np.where(x < OUTLINE, 1.0, np.where(x == OUTLINE, OF_BODY, 0.0))
    q = places(gap=gap, from_column=OUTLINE)
    total = of_body * (D_BODY + S_BODY + I_BODY) + (1 - of_body) * (D_WALL + I_WALL)
    direct = np.where(x < OUTLINE, D_BODY, (1 - of_body) * D_WALL)
    transport = transport_of(direct, total - direct, q)
    return split_of(transport, body_of(x < OUTLINE, q, S_BODY))


def test_an_outline_that_sees_two_places_has_the_components_of_both():
    before = wax_before_a_wall(gap=20)
    split = with_outlines(before)
    parts = [part[:, OUTLINE] for part in split.components(WHITE)]
    expected = (
        OF_BODY * D_BODY + (1 - OF_BODY) * D_WALL,
        OF_BODY * S_BODY,
        OF_BODY * I_BODY + (1 - OF_BODY) * I_WALL,
    )
    for part, value in zip(parts, expected, strict=True):
        np.testing.assert_allclose(part, value, rtol=0.02)
    light = random_pattern(PROJECTOR, 1)
    np.testing.assert_allclose(
        sum(split.components(light)), split.transport @ light, atol=1e-6, err_msg="the sum"
    )
    elsewhere = np.arange(CAMERA.width) != OUTLINE
    for part, was in zip(split.components(light), before.components(light), strict=True):
        np.testing.assert_allclose(part[:, elsewhere], was[:, elsewhere], atol=1e-6)


def test_an_outline_that_a_kernel_fits_badly_is_a_mixture_that_fits_better():
    split = wax_before_a_wall(gap=20)
    x = np.tile(np.arange(CAMERA.width), (CAMERA.height, 1))
    # The kernel takes all but direct light of the outline, so that inter-reflection is no clue.
    light = np.where(x == OUTLINE, split.components(WHITE).interreflection, S_BODY)
    explained = np.where(x == OUTLINE, 0.5, 1.0)
    wider = body_of(x <= OUTLINE, split.transport.correspondence, light, explained)
    found = with_outlines(replace(split, bodies=(wider,)))
    subsurface = found.components(WHITE).subsurface[:, OUTLINE]
    np.testing.assert_allclose(subsurface, OF_BODY * S_BODY, rtol=0.02)


def test_light_on_one_of_both_places_is_direct_light_of_that_one():
    split = with_outlines(wax_before_a_wall(gap=20))
    on_wall = WHITE * (np.arange(PROJECTOR.width) > 16)
    for light, value in ((on_wall, (1 - OF_BODY) * D_WALL), (WHITE - on_wall, OF_BODY * D_BODY)):
        direct = split.components(light).direct[:, OUTLINE]
        np.testing.assert_allclose(direct, value, rtol=0.02)


def test_an_outline_without_a_gap_stays_as_it_is():
    split = wax_before_a_wall(gap=0)
    found = with_outlines(split)
    np.testing.assert_array_equal(found.direct, split.direct)
    assert not len(found.elsewhere.pixels)
    np.testing.assert_array_equal(found.bodies[0].pixels, split.bodies[0].pixels)


@pytest.mark.parametrize(("side", "mixed"), [(1.0, CAMERA.height), (1.25, 0)])
def test_outlines_are_mixtures_where_the_splits_footprints_are_of_single_pixels(side, mixed):
    def squares(length):
        return np.broadcast_to(np.float32([length, length, 0, 0]), (*CAMERA, 4))

    before = wax_before_a_wall(gap=20)
    near = np.zeros((*CAMERA, 1, NearBasis(9, 4).count), np.float32)
    # What the estimate takes for footprints of several projector pixels may be light under wax.
    transport = replace(before.transport, pitch=4, near=near, footprint=squares(1.25))
    found = with_outlines(replace(before, transport=transport, footprint=squares(side)))
    assert len(found.elsewhere.pixels) == mixed


DARKENED = 0.6


def dark_outline(*, q_on_body, alone=False, aside=None, own=1.0, other=1.0):
    """Return `wax_before_a_wall` whose outline is darker, and whose second places were found.

    Parameters
    ----------
    q_on_body : bool
        Whether q of the outline lies on the wax, and the second place on the wall.
    alone : bool
        Whether no camera pixel sees direct light of the wall alone.
    aside : tuple of float, optional
        Second places are so far, (y, x), from q, and not where the other surface goes on.
    own, other : float
        By how much more direct light from q, and from the second place, there is.
    """
    split = wax_before_a_wall(gap=20)
    before = split.transport
    q, direct = before.correspondence.copy(), before.direct.copy()
    on_body, on_wall = q[:, OUTLINE - 1] + [0.0, 1.0], q[:, OUTLINE].copy()
    of_both = np.array([OF_BODY * D_BODY, (1 - OF_BODY) * D_WALL]) * DARKENED
    second = np.full(q.shape, np.nan, np.float32)
    there = np.zeros_like(direct)
    q[:, OUTLINE], second[:, OUTLINE] = (on_body, on_wall) if q_on_body else (on_wall, on_body)
    direct[:, OUTLINE, 0], there[:, OUTLINE, 0] = of_both if q_on_body else of_both[::-1]
    direct[:, OUTLINE] *= own
    there[:, OUTLINE] *= other
    if aside is not None:
        second[:, OUTLINE] = q[:, OUTLINE] + aside
    total = (before @ WHITE)[:, OUTLINE] * DARKENED
    if alone:
        q[:, OUTLINE + 1 :], direct[:, OUTLINE + 1 :] = np.nan, 0.0
    blank = transport_of(direct[..., 0], np.ones(CAMERA), q)
    blank = replace(blank, second_place=second, second_direct=there)
    light = (before @ WHITE).copy()
    light[:, OUTLINE] = total
    rest = (light - blank.components(WHITE).direct)[..., None, None]
    return split_of(replace(blank, far=blank.far * rest), *split.bodies)


@pytest.mark.parametrize("q_on_body", [False, True])
def test_a_second_place_tells_of_a_dark_outline_what_is_mixed(q_on_body):
    before = dark_outline(q_on_body=q_on_body)
    split = with_outlines(before)
    of_body, of_wall = OF_BODY * DARKENED, (1 - OF_BODY) * DARKENED
    expected = (
        of_body * D_BODY + of_wall * D_WALL,
        of_body * S_BODY,
        of_body * I_BODY + of_wall * I_WALL,
    )
    for part, value in zip(split.components(WHITE), expected, strict=True):
        np.testing.assert_allclose(part[:, OUTLINE], value, rtol=0.02)
    on_wall = WHITE * (np.arange(PROJECTOR.width) > 16)
    for light, value in ((on_wall, of_wall * D_WALL), (WHITE - on_wall, of_body * D_BODY)):
        np.testing.assert_allclose(split.components(light).direct[:, OUTLINE], value, rtol=0.02)
    light = random_pattern(PROJECTOR, 1)
    np.testing.assert_allclose(sum(split.components(light)), split.transport @ light, atol=1e-6)


@pytest.mark.parametrize("q_on_body", [False, True])
def test_of_a_surface_that_nothing_about_sees_alone_direct_light_is_known(q_on_body):
    split = with_outlines(dark_outline(q_on_body=q_on_body, alone=True))
    direct, subsurface, rest = (part[:, OUTLINE] for part in split.components(WHITE))
    # Inter-reflection of the wall is unknown, and is shared among what is known.
    known = OF_BODY * (D_BODY + S_BODY + I_BODY) + (1 - OF_BODY) * D_WALL
    shared = DARKENED * (known + (1 - OF_BODY) * I_WALL) / known
    np.testing.assert_allclose(subsurface, shared * OF_BODY * S_BODY, rtol=0.02)
    np.testing.assert_allclose(rest, shared * OF_BODY * I_BODY, rtol=0.02)
    np.testing.assert_allclose(
        direct, shared * (OF_BODY * D_BODY + (1 - OF_BODY) * D_WALL), rtol=0.02
    )


@pytest.mark.parametrize(
    "case",
    [
        pytest.param({"q_on_body": False, "aside": (0.0, 9.0)}, id="not on wax"),
        pytest.param({"q_on_body": True, "aside": (0.0, 1.0)}, id="next to q"),
        pytest.param({"q_on_body": True, "own": 5.0}, id="more direct light than the wax has"),
        pytest.param({"q_on_body": True, "other": 0.02}, id="hardly any"),
    ],
)
def test_second_places_that_are_no_other_surface_tell_nothing(case):
    before = dark_outline(**case, alone=True)
    found = with_outlines(before)
    np.testing.assert_array_equal(found.direct, before.direct)
    assert not len(found.elsewhere.pixels)


@pytest.mark.parametrize(
    "case",
    [
        pytest.param({"aside": (0.0, 9.0)}, id="beside the wall"),
        pytest.param({"other": 8.0}, id="more direct light than the wall has"),
    ],
)
def test_light_tells_a_mixture_whose_second_place_is_not_on_the_wall(case):
    before = dark_outline(q_on_body=True, **case)
    found = with_outlines(before)
    # By the light of the second place it would be 0.03.
    assert np.all(
        found.components(WHITE).subsurface[:, OUTLINE] > 0.8 * DARKENED * OF_BODY * S_BODY
    )
    # The wall is where it goes on from the camera pixels beside the outline.
    goes_on = before.transport.correspondence[:, OUTLINE + 1] - [0.0, 1.0]
    np.testing.assert_allclose(found.elsewhere.places, goes_on, atol=1e-4)


D_DARK_WALL = 0.3


def outline_without_direct_light(total):
    """Return wax before a darker wall; its outline, with q on the wax, has no direct light."""
    x = np.tile(np.arange(CAMERA.width), (CAMERA.height, 1))
    q = places(gap=20, from_column=OUTLINE)
    q[:, OUTLINE] = q[:, OUTLINE - 1] + [0.0, 1.0]
    direct = np.where(x < OUTLINE, D_BODY, np.where(x == OUTLINE, 0.0, D_DARK_WALL))
    light = np.where(x < OUTLINE, D_BODY + S_BODY + I_BODY, D_DARK_WALL + I_WALL)
    light = np.where(x == OUTLINE, total, light)
    transport = transport_of(direct, light - direct, q)
    return split_of(transport, body_of(x < OUTLINE, q, S_BODY))


def test_where_light_tells_no_share_the_body_at_q_has_most():
    """Subsurface light and direct light that was taken for it do not stay inter-reflection."""
    total = 0.7 * (D_DARK_WALL + I_WALL)
    split = with_outlines(outline_without_direct_light(total))
    body, wall = np.array([D_BODY, S_BODY, I_BODY]), np.array([D_DARK_WALL, 0.0, I_WALL])
    mixed = BODY_AT_Q * body + (1 - BODY_AT_Q) * wall
    for part, value in zip(split.components(WHITE), total * mixed / mixed.sum(), strict=True):
        np.testing.assert_allclose(part[:, OUTLINE], value, rtol=0.02)


def test_an_outline_that_sees_a_shadow_stays_as_it_is():
    before = outline_without_direct_light(0.3 * (D_DARK_WALL + I_WALL))
    split = with_outlines(before)
    np.testing.assert_array_equal(split.direct, before.direct)
    np.testing.assert_array_equal(split.bodies[0].pixels, before.bodies[0].pixels)


LOST = 0.1
MIDDLE = (6, 6)


def opaque(next_to_q):
    """Return a split with some light on four sides of q, (Cy, Cx), that direct light lacks."""
    near = np.zeros((*CAMERA, 1, WINDOW, WINDOW))
    middle = WINDOW // 2
    for down, across in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        near[:, :, 0, middle + down, middle + across] = next_to_q / 4
    direct = np.full(CAMERA, 0.5) - next_to_q
    return split_of(transport_of(direct, np.full(CAMERA, 0.1), places(), near))


def test_direct_light_that_one_camera_pixel_has_lost_next_to_q_is_given_back():
    lost = np.zeros(CAMERA)
    lost[MIDDLE] = LOST
    split = without_specks(opaque(lost))
    np.testing.assert_allclose(split.direct, 0.5, rtol=1e-3)
    light = random_pattern(PROJECTOR, 1)
    np.testing.assert_allclose(sum(split.components(light)), split.transport @ light, atol=1e-6)


def test_a_line_of_camera_pixels_with_light_next_to_q_is_a_crease():
    line = np.zeros(CAMERA)
    line[MIDDLE[0]] = LOST
    before = opaque(line)
    np.testing.assert_allclose(without_specks(before).direct, before.direct, atol=1e-6)


def test_a_camera_pixel_partly_in_shadow_keeps_its_direct_light():
    """It stands out by inter-reflection, but not by light next to q."""
    direct = np.full(CAMERA, 0.5)
    direct[MIDDLE] = 0.2
    before = split_of(transport_of(direct, np.full(CAMERA, 0.1), places()))
    np.testing.assert_allclose(without_specks(before).direct, before.direct, rtol=0.01)


@pytest.mark.parametrize("q_there", [(np.nan, np.nan), (3.0, 40.0)])
@pytest.mark.parametrize("shadow", [False, True])
def test_a_camera_pixel_as_bright_as_all_around_it_sees_the_place_in_their_middle(q_there, shadow):
    q = places()
    true = q[MIDDLE].copy()
    q[MIDDLE] = q_there
    direct, interreflection = np.full(CAMERA, 0.5), np.full(CAMERA, 0.1)
    direct[MIDDLE] = 0.0
    interreflection[MIDDLE] = 0.1 if shadow else 0.6
    before = split_of(transport_of(direct, interreflection, q))
    split = without_holes(before)
    parts = [float(part[MIDDLE]) for part in split.components(WHITE)]
    if shadow:
        assert not len(split.elsewhere.pixels)
        return
    assert parts == pytest.approx([0.5, 0.0, 0.1], rel=1e-3)
    np.testing.assert_allclose(split.elsewhere.places, [true], atol=1e-4)


def test_of_two_places_of_a_camera_pixel_the_later_counts():
    one = Elsewhere(np.array([1, 4]), np.array([[0.0, 0.0], [1.0, 1.0]]), np.array([[0.1], [0.2]]))
    two = Elsewhere(np.array([4, 7]), np.array([[2.0, 3.0], [5.0, 5.0]]), np.array([[0.3], [0.4]]))
    both = one.and_also(two)
    assert sorted(both.pixels) == [1, 4, 7]
    (index,) = np.flatnonzero(both.pixels == 4)
    assert both.direct[index] == 0.3
    assert tuple(both.places[index]) == (2.0, 3.0)


@pytest.mark.parametrize(
    ("total", "spread", "moves"),
    [(0.6, 0.0, True), (0.4, 0.0, False), (0.6, 0.03, False)],
    ids=["alone", "less bright", "among unlike ones"],
)
def test_inter_reflection_of_one_camera_pixel_far_beyond_those_around_it_is_direct_light(
    total, spread, moves
):
    interreflection = np.full(CAMERA, 0.1)
    # Two on each side: one may lie beyond.
    interreflection[5, 5:7] = interreflection[6, 5] = 0.1 + spread
    interreflection[MIDDLE] = 0.14
    direct = 0.6 - interreflection
    direct[MIDDLE] = total - 0.14
    before = split_of(transport_of(direct, interreflection, places()))
    split = without_specks(before)
    change = split.direct - before.direct
    # Far-range light is a little light next to q, too.
    assert change[MIDDLE].item() == pytest.approx(0.04 if moves else 0.0, abs=3e-3)
    change[MIDDLE] = 0.0
    np.testing.assert_allclose(change, 0.0, atol=1e-6)


@pytest.mark.parametrize(
    ("there", "moves"),
    [(0.1, True), (0.14, False), (0.0, False)],
    ids=["shadow", "shadow on something as bright", "black"],
)
def test_next_to_a_shadow_inter_reflection_stands_out_from_light_in_it(there, moves):
    interreflection = np.full(CAMERA, 0.1)
    interreflection[MIDDLE] = 0.14
    direct = 0.6 - interreflection
    q = places()
    # Three camera pixels: one may lie beyond.
    for pixel in ((5, 5), (5, 6), (5, 7)):
        q[pixel] = np.nan
        direct[pixel], interreflection[pixel] = 0.0, there
    before = split_of(transport_of(direct, interreflection, q))
    change = without_specks(before).direct - before.direct
    assert change[MIDDLE].item() == pytest.approx(0.04 if moves else 0.0, abs=3e-3)
    change[MIDDLE] = 0.0
    np.testing.assert_allclose(change, 0.0, atol=1e-3)


@pytest.mark.parametrize("place", [(0, 6), (6, 0), (CAMERA.height - 1, CAMERA.width - 1)])
def test_a_speck_at_the_border_is_told_by_those_on_its_other_side(place):
    interreflection = np.full(CAMERA, 0.1)
    interreflection[place] = 0.14
    before = split_of(transport_of(0.6 - interreflection, interreflection, places()))
    change = without_specks(before).direct - before.direct
    assert change[place].item() == pytest.approx(0.04, abs=3e-3)
    change[place] = 0.0
    np.testing.assert_allclose(change, 0.0, atol=1e-3)


@pytest.mark.parametrize("pitch", [1, 4])
def test_direct_light_that_the_transport_lacks_comes_from_q(pitch):
    """What is moved to where the estimate has no direct light at all is relit like any other."""
    q = places() + 0.25

    def transport(direct):
        found = transport_of(direct, np.full(CAMERA, 0.4), q)
        if pitch == 1:
            return found
        boxes = np.broadcast_to(np.float32([1.5, 1.0, 0.0, 0.0]), (*CAMERA, 4))
        near = np.zeros((*CAMERA, 1, NearBasis(9, pitch).count), np.float32)
        return replace(found, pitch=pitch, near=near, footprint=boxes)

    direct = np.full(CAMERA, 0.3)
    everywhere = split_of(transport(direct))
    direct[:, OUTLINE] = 0.0
    lacking = transport(direct)
    split = replace(split_of(lacking), direct=everywhere.direct)
    light = random_pattern(PROJECTOR, 1)
    parts = split.components(light)
    np.testing.assert_allclose(parts.direct, everywhere.components(light).direct, atol=1e-6)
    np.testing.assert_allclose(sum(parts), lacking @ light, atol=1e-6)
