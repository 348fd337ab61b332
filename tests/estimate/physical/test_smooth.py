"""Inter-reflection that is smooth over camera pixels, and that of camera pixels at creases."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar import random_pattern, split_physically
from nearfar.estimate.physical.crease_light import at_creases, with_crease_light
from nearfar.estimate.physical.elsewhere import Elsewhere
from nearfar.estimate.physical.smooth import with_smooth_interreflection
from nearfar.estimate.physical.split import with_more_direct
from tests.estimate.physical.even import CAMERA, PROJECTOR, WHITE, places, split_of, transport_of

ERROR = 0.01
NO_CREASES = np.zeros(CAMERA, dtype=bool)
# A plane of shares: albedo is that of a checkerboard.
Y, X = np.mgrid[: CAMERA.height, : CAMERA.width]
SHARE = 0.1 + 0.01 * Y + 0.005 * X
TOTAL = np.where((Y // 3 + X // 3) % 2, 0.3, 0.6)
INNER = (slice(1, -1), slice(1, -1))


def split_with(interreflection, total=TOTAL):
    """Return a split with given inter-reflection, of given light under white."""
    return split_of(transport_of(total - interreflection, interreflection, places()))


def known_to(deviation):
    return np.full((*CAMERA, 1), deviation)


def interreflection_of(split):
    return split.components(WHITE).interreflection


def errors():
    return ERROR * np.random.default_rng(5).standard_normal(CAMERA)


def test_what_direct_light_errs_is_taken_off_inter_reflection():
    true = SHARE * TOTAL
    before = split_with(true + errors())
    after = with_smooth_interreflection(before, known_to(ERROR), NO_CREASES)
    left = (interreflection_of(after) - true)[INNER]
    assert np.sqrt(np.mean(left**2)) < 0.65 * ERROR
    np.testing.assert_allclose(
        after.components(WHITE).direct, TOTAL - interreflection_of(after), atol=1e-6
    )
    light = random_pattern(PROJECTOR, 1)
    np.testing.assert_allclose(sum(after.components(light)), after.transport @ light, atol=1e-6)
    assert after.own_share.min() == pytest.approx(1 / 9)
    # What the weights promise of the variance is what is left of it.
    assert np.mean(left**2) == pytest.approx(ERROR**2 * after.own_share[INNER].mean(), rel=0.4)


def test_a_plane_of_shares_stays_under_any_albedo():
    before = split_with(SHARE * TOTAL)
    after = with_smooth_interreflection(before, known_to(ERROR), NO_CREASES)
    np.testing.assert_allclose(after.direct, before.direct, atol=1e-6)


@pytest.mark.parametrize("deviation", [0.0, np.inf])
def test_nothing_changes_where_errors_are_none_or_unknown(deviation):
    before = split_with(SHARE * TOTAL + errors())
    after = with_smooth_interreflection(before, known_to(deviation), NO_CREASES)
    np.testing.assert_array_equal(after.direct, before.direct)
    np.testing.assert_array_equal(after.own_share, 1.0)


def test_a_step_far_above_errors_stays():
    share = np.where(X < 6, 0.1, 0.3)
    before = split_with(share * TOTAL)
    after = with_smooth_interreflection(before, known_to(ERROR), NO_CREASES)
    np.testing.assert_allclose(interreflection_of(after), share * TOTAL, atol=0.5 * ERROR)


def test_creases_are_not_smoothed():
    before = split_with(SHARE * TOTAL + errors())
    creases = X < 6
    after = with_smooth_interreflection(before, known_to(ERROR), creases)
    np.testing.assert_array_equal(after.direct[creases], before.direct[creases])
    np.testing.assert_array_equal(after.own_share[creases], 1.0)
    assert after.own_share[~creases].min() < 0.5


def test_a_dark_camera_pixel_with_a_noisy_share_draws_no_bright_one():
    total = np.full(CAMERA, 0.6)
    total[6] = 0.02
    interreflection = 0.1 * total
    # Of the dark line half is inter-reflection, by chance.
    interreflection[6] = 0.01
    before = split_with(interreflection, total)
    after = with_smooth_interreflection(before, known_to(ERROR), NO_CREASES)
    bright = total > 0.1
    np.testing.assert_allclose(
        interreflection_of(after)[bright], interreflection[bright], atol=0.1 * ERROR
    )


def test_light_from_elsewhere_is_not_smoothed():
    before = split_with(SHARE * TOTAL + errors())
    other = Elsewhere(np.array([84]), np.array([[3.0, 40.0]]), np.array([[0.05]]))
    after = with_smooth_interreflection(
        replace(before, elsewhere=other), known_to(ERROR), NO_CREASES
    )
    assert after.direct.ravel()[84] == before.direct.ravel()[84]
    assert after.own_share.ravel()[84] == 1.0


ROW = 6


def ridge(line):
    """Return a split with more inter-reflection at a row, a crease, and where its creases are."""
    interreflection = np.full(CAMERA, 0.1)
    interreflection[[ROW - 1, ROW + 1]] = 0.13
    interreflection[ROW] = line
    pixels = ROW * CAMERA.width + np.arange(CAMERA.width)
    split = split_with(interreflection, np.full(CAMERA, 0.6))
    drawn = Elsewhere(pixels, split.transport.correspondence.reshape(-1, 2)[pixels], None)
    return split, at_creases(split, drawn)


def test_creases_are_the_camera_pixels_that_were_drawn_aside_and_those_next_to_them():
    _, creases = ridge(0.15)
    np.testing.assert_array_equal(creases, np.abs(Y - ROW) <= 1)


def test_dark_points_at_a_crease_are_as_bright_as_most_around_them():
    line = np.where(np.arange(CAMERA.width) % 3 == 1, 0.02, 0.15)
    split, creases = ridge(line)
    after = with_crease_light(split, creases)
    here = interreflection_of(after)[ROW]
    np.testing.assert_allclose(here[line > 0.1], 0.15, atol=1e-6)
    np.testing.assert_allclose(here[line < 0.1][:-1], 0.13, atol=1e-6)
    light = random_pattern(PROJECTOR, 1)
    np.testing.assert_allclose(sum(after.components(light)), after.transport @ light, atol=1e-6)
    np.testing.assert_array_equal(after.direct[~creases], split.direct[~creases])


def test_no_point_at_a_crease_is_brighter_than_those_before_and_behind_it():
    line = np.full(CAMERA.width, 0.15)
    line[6] = 0.25
    split, creases = ridge(line)
    here = interreflection_of(with_crease_light(split, creases))[ROW]
    np.testing.assert_allclose(here, 0.15, atol=1e-6)


def test_direct_light_that_comes_from_elsewhere_alone_pays_there():
    line = np.full(CAMERA.width, 0.15)
    line[6] = 0.02
    split, creases = ridge(line)
    pixel, direct = ROW * CAMERA.width + 6, split.direct.copy()
    direct[ROW, 6] = 0.0
    place = split.transport.correspondence[ROW, 6][None]
    only = Elsewhere(np.array([pixel]), place, np.array([[0.6 - 0.02]]))
    after = with_crease_light(replace(split, direct=direct, elsewhere=only), creases)
    assert not after.direct[ROW, 6].any()
    assert after.elsewhere.direct[0, 0] == pytest.approx(0.6 - 0.13, abs=1e-6)


def test_no_direct_light_becomes_negative():
    split = split_with(SHARE * TOTAL)
    after = with_more_direct(split, np.full((*CAMERA, 1), -1.0))
    np.testing.assert_array_equal(after.direct, 0.0)


def test_without_creases_and_without_error_bars_nothing_changes():
    split, _ = ridge(np.full(CAMERA.width, 0.15))
    assert with_crease_light(split, NO_CREASES) is split
    assert split_physically(split.transport).own_share is None
