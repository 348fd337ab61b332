"""Light of creases that drew q aside, and the q that camera pixels beside them tell."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.estimate.physical import split_physically
from nearfar.estimate.physical.told import HALF_ANGLE, LEAST_TELLING, REACH, told_by_others
from tests.estimate.physical.synthetic import PROJECTOR, WINDOW, transport_of

CREASE_ROW = 16
DRAWN = 0.12


@pytest.fixture(scope="module")
def crease():
    """Return a transport at one row of which the other side of a crease has drawn q, and its q."""
    near = np.zeros((*PROJECTOR, 2, WINDOW, WINDOW))
    middle = WINDOW // 2
    # Falls off to the sides of q and away from the crease; the first entry is not window light.
    near[CREASE_ROW, :, :, middle - 1, middle - 1 : middle + 2] = [0.008, 0.0, 0.008]
    near[CREASE_ROW, :, :, middle - 2, middle - 1 : middle + 2] = [0.004, 0.006, 0.004]
    transport = transport_of(near, np.full((*PROJECTOR, 2), 0.4))
    drawn = transport.correspondence.copy()
    drawn[CREASE_ROW, :, 0] -= DRAWN
    return replace(transport, correspondence=drawn), transport.correspondence


def test_light_of_a_crease_that_drew_q_is_inter_reflection(crease):
    transport, _ = crease
    split = split_physically(transport)
    inner = slice(2, -2)
    lines = {row: np.zeros(PROJECTOR, np.float32) for row in (CREASE_ROW - 1, CREASE_ROW)}
    for row, light in lines.items():
        light[row] = 1.0
        parts = split.components(light)
        here = [part[CREASE_ROW, inner] for part in parts]
        np.testing.assert_allclose(sum(parts), transport @ light, atol=1e-6)
        if row == CREASE_ROW:
            np.testing.assert_allclose(here[0], 0.4 * (1 - DRAWN), rtol=1e-3)
        else:
            assert not here[0].any()
            assert here[2].min() > 0.4 * DRAWN
    unlike = np.arange(PROJECTOR.height) != CREASE_ROW
    np.testing.assert_array_equal(split.direct[unlike], transport.direct[unlike])


@pytest.mark.parametrize("side", ["none", "both"])
def test_a_place_between_projector_pixels_stays_where_no_crease_is(crease, side):
    transport, _ = crease
    near = transport.near.copy()
    near = near * 0 if side == "none" else near + near[..., ::-1, :]
    split = split_physically(replace(transport, near=near))
    np.testing.assert_array_equal(split.direct, transport.direct)


def test_camera_pixels_that_are_drawn_aside_tell_nothing_of_others(crease):
    """Every side of the line in the middle begins with a line that is drawn aside as well."""
    transport, whole = crease
    q, near = transport.correspondence.copy(), transport.near.copy()
    for row in (CREASE_ROW - 1, CREASE_ROW + 1):
        q[row, :, 0] -= 0.4 * DRAWN
        near[row] = near[CREASE_ROW]
    split = split_physically(replace(transport, correspondence=q, near=near))
    found = np.full((*PROJECTOR, 2), np.nan)
    found.reshape(-1, 2)[split.elsewhere.pixels] = split.elsewhere.places
    for row in range(CREASE_ROW - 1, CREASE_ROW + 2):
        np.testing.assert_allclose(found[row], whole[row], atol=1e-4)


@pytest.mark.parametrize(
    ("drawn", "count", "is_moved"), [(0.12, 1, True), (0.25, 1, False), (0.25, 5, True)]
)
def test_far_off_are_lines_of_camera_pixels_alone(crease, drawn, count, is_moved):
    """A camera pixel between two surfaces has a q of its own, and is no crease."""
    transport, whole = crease
    q, near = whole.copy(), transport.near.copy()
    line = slice(14, 14 + count)
    q[CREASE_ROW, line, 0] -= drawn
    others = np.ones(PROJECTOR.width, dtype=bool)
    others[line] = False
    near[CREASE_ROW, others] = 0.0
    split = split_physically(replace(transport, correspondence=q, near=near))
    moved = np.zeros(PROJECTOR, dtype=bool)
    moved.ravel()[split.elsewhere.pixels] = True
    assert np.all(moved[CREASE_ROW, line] == is_moved)
    assert not moved[:, others].any()


@pytest.mark.parametrize("falling_off", [1, 31])
def test_camera_pixels_of_a_crease_decide_together_whether_light_falls_off(crease, falling_off):
    """Noise may hide it from one, or show it to one."""
    transport, _ = crease
    near = transport.near.copy()
    few = np.arange(PROJECTOR.width) == PROJECTOR.width // 2
    near[CREASE_ROW, ~few if falling_off == 1 else few] = 0.0
    split = split_physically(replace(transport, near=near))
    every = CREASE_ROW * PROJECTOR.width + np.arange(PROJECTOR.width)
    expected = [] if falling_off == 1 else every
    np.testing.assert_array_equal(np.sort(split.elsewhere.pixels), expected)


def test_what_the_projector_blurs_is_no_light_of_a_crease(crease):
    """Of a wider footprint a shift moves a lesser share, and none of it is lost."""
    transport, _ = crease
    blurred = np.broadcast_to(np.float32([1.12, 1.12, 0.0, 0.0]), (*PROJECTOR, 4))
    found = split_physically(replace(transport, footprint=blurred)).elsewhere
    assert len(found.pixels) == PROJECTOR.width
    kept = found.direct / 0.4
    assert kept.min() > 1 - DRAWN
    assert kept.max() < 1


def telling_places(noise, *, seed=5):
    """Return q on a slanted plane, with noise, and without."""
    y, x = np.mgrid[:20, :23].astype(np.float64)
    plane = np.stack([900.0 + 1.3 * y - 0.2 * x, 40.0 + 0.1 * y + 0.8 * x], axis=-1)
    return plane + np.random.default_rng(seed).normal(0, noise, plane.shape), plane


def test_a_side_tells_what_the_plane_of_least_squares_through_it_does():
    """Of a corner's camera pixel three sides are known, at least in part."""
    q, _ = telling_places(0.02)
    told, deviation = told_by_others(q, np.ones(q.shape[:2], bool))
    y, x = np.mgrid[: REACH + 1, : REACH + 1]
    around = (np.hypot(y, x) <= REACH + 0.5) & ((y > 0) | (x > 0))
    by_side = []
    for middle in (0.0, np.pi / 4, np.pi / 2):
        within = around & (np.abs(np.arctan2(y, x) - middle) <= HALF_ANGLE)
        design = np.column_stack([np.ones(within.sum()), y[within], x[within]])
        plane, left, _, _ = np.linalg.lstsq(design, q[: REACH + 1, : REACH + 1][within], rcond=None)
        variance = left.max() / (len(design) - 3) * np.linalg.inv(design.T @ design)[0, 0]
        by_side.append((np.sqrt(variance), plane[0].tolist()))
    least, expected = min(by_side)
    assert deviation[0, 0] == pytest.approx(least, rel=1e-6)
    np.testing.assert_allclose(told[0, 0], expected, rtol=1e-9)


def test_what_others_tell_is_as_far_off_as_its_deviation_says():
    q, plane = telling_places(0.02)
    told, deviation = told_by_others(q, np.ones(q.shape[:2], bool))
    inner = slice(REACH, -REACH)
    off = (np.abs(told - plane).max(axis=-1) / deviation)[inner, inner]
    assert 0.5 < np.sqrt(np.mean(off**2)) < 2.0


def test_the_side_tells_whose_surface_goes_on():
    """Where q bends, planes through both surfaces tell it worse. Next to it, both may be right."""
    q, plane = telling_places(0.0)
    bend = np.maximum(np.arange(q.shape[1]) - 11, 0.0)
    q = plane + 0.5 * bend[:, None] * np.array([1.0, 0.0])
    told, _ = told_by_others(q, np.ones(q.shape[:2], bool))
    away = np.abs(np.arange(q.shape[1]) - 11) != 1
    np.testing.assert_allclose(told[:, away], q[:, away], rtol=1e-9)


def test_camera_pixels_that_may_not_tell_have_no_say():
    q, plane = telling_places(0.0)
    q[:, 7], q[4, 4] = np.nan, 1e6
    telling = np.isfinite(q).all(axis=-1) & (q[..., 0] < 1e5)
    told, deviation = told_by_others(q, telling)
    np.testing.assert_allclose(told, plane, rtol=1e-9)
    assert deviation.max() < 1e-4


@pytest.mark.parametrize("camera", [(1, 40), (40, 1), (2, 2), (1, 1)])
def test_few_camera_pixels_or_a_line_of_them_tell_nothing(camera):
    told, deviation = told_by_others(np.zeros((*camera, 2)), np.ones(camera, bool))
    assert np.isnan(told).all()
    assert np.isinf(deviation).all()


def test_as_few_as_tell_at_all():
    q, plane = telling_places(0.0)
    telling = np.zeros(q.shape[:2], bool)
    telling[10, 13 : 13 + LEAST_TELLING // 2] = True
    telling[11, 13 : 13 + (LEAST_TELLING + 1) // 2] = True
    told, _ = told_by_others(q, telling)
    np.testing.assert_allclose(told[10, 12], plane[10, 12], rtol=1e-9)
    telling[10, 13] = False
    told, _ = told_by_others(q, telling)
    assert np.isnan(told[10, 12]).all()
