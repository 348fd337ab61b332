"""Direct light of second surfaces beyond the window."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar import ErrorBars
from nearfar.arrays import Size
from nearfar.estimate.joint import choose_components, estimate_jointly, second_places
from nearfar.estimate.joint.estimator import JointEstimator
from nearfar.plan.look import look_at
from nearfar.plan.typical import typical_of
from nearfar.priors.fitted import LIGHT_FROM_ANYWHERE
from nearfar.transport.direct import footprint
from tests.estimate.joint.draws import FAR, PROJECTOR, WINDOW, chosen_frequencies, measured

CAMERA = Size(10, 9)
# The last column of camera pixels of the left surface, which also see the right one.
OUTLINE = 4
SECOND_LIGHT = 0.25


def surfaces(rows=CAMERA.height):
    """Return q of two surfaces, ten projector pixels apart, both ten pixels high."""
    y, x = np.meshgrid(np.arange(rows) * 10 / rows, np.arange(9.0), indexing="ij")
    return np.stack([y + 3.3, np.where(x <= OUTLINE, x, x + 8) + 1.7], axis=-1)


def places(q):
    """Return the second places of the outline: between those of the next column, and beside."""
    beside = q[:, OUTLINE + 1]
    return beside + np.array([0.25, -0.5])


def rows_of(q, second=SECOND_LIGHT, seed=1):
    """Return dense rows, (C, 1, P): direct light at q, that of the outline, and smooth light."""
    generator, camera = np.random.default_rng(seed), Size(*q.shape[:2])
    rows = np.zeros((camera.pixels, 1, PROJECTOR.pixels))
    where = footprint(q.reshape(-1, 2), PROJECTOR)
    np.put_along_axis(rows[:, 0], where.pixels, 0.5 * where.weights, axis=1)
    where = footprint(places(q), PROJECTOR)
    outline = np.arange(camera.height) * camera.width + OUTLINE
    for number, pixels, weights in zip(outline, where.pixels, where.weights, strict=True):
        rows[number, 0, pixels] += second * weights
    y, x = np.meshgrid(*(np.arange(side) for side in PROJECTOR), indexing="ij")
    for c, (up, across) in enumerate(generator.uniform(0, 6, (camera.pixels, 2))):
        wave = 1 + 0.3 * np.cos(2 * np.pi * y / 16 + up) * np.cos(2 * np.pi * x / 20 + across)
        rows[c, 0] += 1e-3 * wave.ravel()
    return rows


def estimated(seen, q, noise=1e-3, **options):
    measurements = measured(seen, chosen_frequencies(70), noise=noise, camera=CAMERA)
    return estimate_jointly(measurements, q.astype(np.float32), WINDOW, FAR, pitch=1, **options)


def has_second(transport):
    return np.isfinite(transport.second_place).all(axis=-1)


@pytest.mark.parametrize("more", [0.1, 0.2])
def test_a_second_place_is_found_beside_light_that_no_smooth_component_holds(more):
    """Next to q the window has a spike, so that photos alone are likeliest by free rows."""
    q = surfaces()
    rows = rows_of(q)
    where = footprint(q[:, OUTLINE] - np.array([0.0, 2.0]), PROJECTOR)
    outline = np.arange(CAMERA.height) * CAMERA.width + OUTLINE
    for number, pixels, weights in zip(outline, where.pixels, where.weights, strict=True):
        rows[number, 0, pixels] += more * weights
    transport = estimated(rows, q)
    found = has_second(transport)
    assert found[:, OUTLINE].all()
    assert not np.delete(found, OUTLINE, axis=1).any()
    off = transport.second_place[:, OUTLINE] - places(q)
    assert np.abs(off).max() < 0.3


@pytest.fixture(scope="module")
def found():
    q = surfaces()
    return estimated(rows_of(q), q)


def test_second_places_and_their_light_are_found(found):
    expected = np.zeros(CAMERA, dtype=bool)
    expected[:, OUTLINE] = True
    np.testing.assert_array_equal(has_second(found), expected)
    np.testing.assert_allclose(found.second_place[:, OUTLINE], places(surfaces()), atol=0.15)
    np.testing.assert_allclose(found.second_direct[:, OUTLINE, 0], SECOND_LIGHT, atol=0.01)
    assert not found.second_direct[~expected].any()
    np.testing.assert_allclose(found.direct[:, OUTLINE, 0], 0.5, atol=0.02)


def test_places_that_are_left_out_cost_no_second_place(found, monkeypatch):
    """Finer places are tried about some of the coarse ones alone."""
    monkeypatch.setattr(second_places, "LEAST_COARSE_GAIN", -np.inf)
    q = surfaces()
    thorough = estimated(rows_of(q), q)
    np.testing.assert_array_equal(thorough.second_place, found.second_place)
    np.testing.assert_allclose(thorough.second_direct, found.second_direct, rtol=1e-5)


def test_the_outline_relights_as_well_as_the_rest(found):
    rows = rows_of(surfaces())[:, 0]
    lights = np.random.default_rng(5).random((20, PROJECTOR.pixels))
    pictures = found.pictures(lights.reshape(20, *PROJECTOR).astype(np.float32)).reshape(20, -1)
    error = np.sqrt(np.mean((pictures - lights @ rows.T) ** 2, axis=0)).reshape(CAMERA)
    at_outline = np.sqrt(np.mean(error[:, OUTLINE] ** 2))
    assert at_outline < 3 * np.median(error)
    assert at_outline < 0.05 * SECOND_LIGHT


def test_where_there_is_none_none_is_found():
    q = surfaces()
    assert not has_second(estimated(rows_of(q, second=0.0), q)).any()


def test_light_that_photos_do_not_tell_from_noise_is_left_alone():
    q = surfaces()
    assert not has_second(estimated(rows_of(q, second=0.002), q, noise=3e-3)).any()


def test_light_within_the_window_is_the_windows():
    q = surfaces()
    q[:, OUTLINE + 1 :, 1] -= 8.0
    assert not has_second(estimated(rows_of(surfaces()), q)).any()


def test_no_second_place_has_a_projector_pixel_in_the_window():
    q = surfaces()
    # The next column's q lies beyond the window, the light at the outline half inside it.
    q[:, OUTLINE + 1 :, 1] -= 6.0
    found = estimated(rows_of(q), q)
    has = has_second(found)
    apart = np.abs(found.second_place - np.rint(found.correspondence)).max(axis=-1)
    assert np.all(apart[has] >= WINDOW // 2 + 1)


def test_a_camera_pixel_without_direct_light_at_q_has_none_elsewhere():
    q = surfaces()
    q[4, OUTLINE] = np.nan
    assert not has_second(estimated(rows_of(surfaces()), q))[4, OUTLINE]


def test_some_rows_of_the_camera_are_estimated_as_among_all(found):
    q = surfaces()
    some = estimated(rows_of(q), q, rows=slice(3, 7))
    for name in ("second_place", "second_direct", "direct", "near"):
        np.testing.assert_allclose(getattr(some, name), getattr(found, name)[3:7], atol=1e-5)


def test_a_tile_with_its_halo_is_estimated_as_the_whole():
    q, halo, photos = surfaces(24), JointEstimator().halo, chosen_frequencies(40)
    # With so much noise, neighbours have a say.
    seen = rows_of(q, second=0.1)
    whole_camera = Size(24, CAMERA.width)
    measurements = measured(seen, photos, noise=5e-3, camera=whole_camera)
    whole = estimate_jointly(measurements, q.astype(np.float32), WINDOW, FAR, pitch=1)
    for row in (9, 12):
        around = slice(row - halo, row + halo + 1)
        width = CAMERA.width
        part = measurements.of_pixels(
            Size(2 * halo + 1, width), slice(width * around.start, width * around.stop)
        )
        found = estimate_jointly(part, q[around].astype(np.float32), WINDOW, FAR, pitch=1)
        assert has_second(found)[halo].any()
        for name in ("second_place", "second_direct", "direct", "near", "far"):
            one, other = getattr(found, name)[halo], getattr(whole, name)[row]
            np.testing.assert_allclose(one, other, atol=2e-6, err_msg=name)


def test_choices_by_the_same_photos_change_nothing(found):
    q = surfaces()
    measurements = measured(rows_of(q), chosen_frequencies(70), noise=1e-3, camera=CAMERA)
    given = (measurements, q.astype(np.float32), WINDOW)
    chosen = choose_components(*given, pitch=1)
    again = estimate_jointly(*given, FAR, pitch=1, chosen=chosen)
    np.testing.assert_array_equal(has_second(again), has_second(found))
    np.testing.assert_allclose(again.second_direct, found.second_direct, atol=1e-3)


def test_error_bars_know_that_it_may_be_elsewhere_and_more_or_less(found):
    rows = rows_of(surfaces())[:, 0]
    generator = np.random.default_rng(7)
    bars, within = ErrorBars(found), []
    for light in generator.random((40, *PROJECTOR)).astype(np.float32):
        error = np.abs((found @ light).ravel() - rows @ light.ravel()).reshape(CAMERA)
        within.append((error < bars.picture(light))[:, OUTLINE])
    assert 0.5 < np.mean(within) < 0.9


def test_single_entries_have_error_bars_at_second_places(found):
    pixel = 5 * CAMERA.width + OUTLINE
    bars = ErrorBars(found).component_rows(slice(pixel, pixel + 1)).direct[0, 0]
    where = footprint(found.second_place[5, OUTLINE][None], PROJECTOR)
    at_place = bars[where.pixels[0]]
    # About as unsure as direct light at q, and known far better than its own size.
    assert np.all(at_place[where.weights[0] > 0.1] > 0)
    assert at_place.sum() == pytest.approx(bars.sum() - at_place.sum(), rel=0.5)
    assert at_place.sum() < 0.1 * SECOND_LIGHT
    line = int(where.pixels[0][0] // PROJECTOR.width)
    along = ErrorBars(found).along(pixel, line).direct[0]
    np.testing.assert_allclose(along, bars.reshape(PROJECTOR)[line], rtol=1e-6)


def test_a_plan_after_a_look_expects_light_from_anywhere(found):
    plain = replace(found, second_place=None, second_direct=None)

    def from_anywhere(transport):
        typical = typical_of(transport)
        chosen = [component == LIGHT_FROM_ANYWHERE for component, _ in typical.prior_components]
        return float(typical.shares[0] @ chosen)

    # One camera pixel in nine, and brighter than the others.
    assert from_anywhere(found) > from_anywhere(plain) + 1 / 9
    # The model holds there all the same.
    assert look_at(found).free_share == look_at(plain).free_share
