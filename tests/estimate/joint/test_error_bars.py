"""Error bars: dense Gaussian algebra, and how often the truth lies within them."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.estimate import error_bars
from nearfar.estimate.error_bars import ErrorBars
from nearfar.estimate.fit import fit_model
from nearfar.estimate.joint import error_bars as error_bars_of_joint
from nearfar.estimate.joint import estimate_jointly
from nearfar.estimate.joint.nuisance import (
    DIRECT_PRIOR_DEVIATION,
)
from nearfar.illumination.near_basis import window_offsets
from nearfar.illumination.pictures import standard_lights
from nearfar.illumination.real_basis import real_basis
from nearfar.photometry.measure import measure
from nearfar.plan import choose_plan
from nearfar.priors.covariance import far_variance, near_covariance, spectral_density
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.cache import cached_scene
from nearfar.transport import near
from nearfar.transport.direct import footprint
from nearfar.transport.quality import Quality
from nearfar.workflow.acquire import acquire_in_memory
from tests.estimate.joint.dense_bars import (
    COMPONENT,
    LIGHT,
    NOISE,
    OFFSET,
    PROJECTOR,
    SCALE,
    SHARE,
    WHITE,
    WINDOW,
    dense_deviation,
    in_channels,
    prior_variance,
    transport_at,
    weights_of_picture,
)
from tests.estimate.lights_together import assert_each_light_has_its_own_errors


def test_a_picture_is_as_uncertain_as_dense_algebra_says():
    centres = np.array([[6, 8], [5, 7], [2, 13]])
    transport = transport_at(centres)
    light = _held_light(transport)
    found = ErrorBars(transport).picture(light)
    expected = [
        dense_deviation(transport, c, weights_of_picture(transport, c, light))
        for c in range(len(centres))
    ]
    np.testing.assert_allclose(found[0], expected, rtol=2e-3)


@pytest.mark.parametrize("place", [(6, 8), (1, 14)])
def test_noise_that_neighbours_take_off_is_left_out_of_near_and_far_alone(place):
    def bars_of(noise, share):
        return ErrorBars(transport_at(np.array([place]), noise=noise, noise_share=share))

    light = _held_light(transport_at(np.array([place])))
    noise, share = 20 * NOISE, 0.5
    of_all = noise, 1.0
    of_less = noise, share
    of_little = noise * share**0.5, 1.0
    # Direct light is told by the camera pixel's own photos.
    np.testing.assert_array_equal(bars_of(*of_less).direct(), bars_of(*of_all).direct())
    most, left, least = (
        bars_of(*each).picture(light)[0, 0] for each in (of_all, of_less, of_little)
    )
    # Direct light's own uncertainty is all that less noise would lower further.
    assert least < left < most - 0.9 * (most - least)


def _held_light(transport):
    """Return a light without what the transport does not hold of f."""
    light = np.zeros(PROJECTOR)
    for k, amount in zip(transport.far_basis.frequencies, (0.5, 0.2, 0.1, 0.15, 0.05), strict=True):
        y, x = np.indices(PROJECTOR)
        light += amount * np.cos(2 * np.pi * (float(k.fy) * y + float(k.fx) * x) + amount)
    return light


def test_entries_beyond_the_border_are_known_to_be_none():
    # The estimate rounds variance ratios to powers of 2 there.
    scale = np.sqrt(512) * NOISE / WHITE
    centres = np.array([[0, 8], [6, 15], [1, 14], [11, 0], [11, 0], [6, 8]])
    transport = transport_at(centres)
    posterior = transport.posterior
    scales = np.full_like(posterior.prior_scale, scale)
    transport = replace(transport, posterior=replace(posterior, prior_scale=scales))
    light = _held_light(transport)
    bars = ErrorBars(transport)
    found = bars.picture(light)
    expected = [
        dense_deviation(transport, c, weights_of_picture(transport, c, light), scale)
        for c in range(len(centres))
    ]
    np.testing.assert_allclose(found[0], expected, rtol=2e-3)
    # One camera pixel alone, and its many entries, are no different.
    rows = bars.component_rows(slice(2, 3))
    assert np.count_nonzero(rows.near) == 4 * 4
    count = len(weights_of_picture(transport, 2, light))
    for entry, offset in enumerate(window_offsets(WINDOW)):
        y, x = centres[2] + offset
        if y < 0 or x >= PROJECTOR.width:
            continue
        one = np.zeros(count)
        one[3 + entry] = 1.0
        expected = dense_deviation(transport, 2, one, scale)
        assert rows.near[0, 0, y * PROJECTOR.width + x] == pytest.approx(expected, rel=5e-3)
    of_direct = np.zeros(count)
    of_direct[2] = 1.0
    assert bars.direct()[0, 2, 0] == pytest.approx(
        dense_deviation(transport, 2, of_direct, scale), rel=2e-3
    )
    single = np.zeros(PROJECTOR)
    single[3, 12] = 1.0
    weights = weights_of_picture(transport, 2, single)
    weights[2] = -1.0 / PROJECTOR.pixels
    inside = near.inside(centres[2:3], WINDOW, PROJECTOR)[0]
    weights[3 : 3 + WINDOW**2] = inside * (-1.0 / PROJECTOR.pixels)
    expected = dense_deviation(transport, 2, weights, scale)
    assert rows.far[0, 0, 3 * PROJECTOR.width + 12] == pytest.approx(expected, rel=5e-3)


def test_what_the_transport_does_not_hold_adds_its_expected_power():
    transport = transport_at(np.array([[6, 8]]))
    light = np.random.default_rng(1).random(PROJECTOR)
    spectrum = np.abs(np.fft.fft2(light)) ** 2
    cycles = [np.fft.fftfreq(side) * side for side in PROJECTOR]
    radius = np.hypot(cycles[0][:, None], cycles[1])
    unseen = spectral_density(radius, COMPONENT) * spectrum
    unseen[(np.abs(cycles[0])[:, None] <= 1) & (np.abs(cycles[1]) <= 1)] = 0.0
    extra = (SCALE * WHITE) ** 2 * unseen.sum() / PROJECTOR.pixels**2
    expected = np.hypot(
        dense_deviation(transport, 0, weights_of_picture(transport, 0, light)), np.sqrt(extra)
    )
    assert ErrorBars(transport).picture(light)[0, 0] == pytest.approx(expected, rel=2e-3)


def test_entries_are_as_uncertain_as_dense_algebra_says():
    transport = transport_at(np.array([[6, 8]]))
    bars = ErrorBars(transport)
    rows = bars.component_rows(slice(0, 1))
    count = len(weights_of_picture(transport, 0, np.zeros(PROJECTOR)))
    of_direct = np.zeros(count)
    of_direct[2] = 1.0
    assert bars.direct()[0, 0, 0] == pytest.approx(
        dense_deviation(transport, 0, of_direct), rel=2e-3
    )
    at = 6 * PROJECTOR.width + 8
    assert rows.direct[0, 0, at] == pytest.approx(bars.direct()[0, 0, 0])
    assert np.count_nonzero(rows.direct) == 1
    for entry, (y, x) in enumerate(window_offsets(WINDOW)):
        one = np.zeros(count)
        one[3 + entry] = 1.0
        place = (6 + y) * PROJECTOR.width + 8 + x
        assert rows.near[0, 0, place] == pytest.approx(dense_deviation(transport, 0, one), rel=5e-3)
    assert np.count_nonzero(rows.near) == WINDOW**2
    for place in (0, at, 100):
        # An entry of F: T's, without d and n themselves.
        light = np.zeros(PROJECTOR)
        light.flat[place] = 1.0
        weights = weights_of_picture(transport, 0, light)
        weights[2] = -1.0 / PROJECTOR.pixels
        weights[3 : 3 + WINDOW**2] = -1.0 / PROJECTOR.pixels
        expected = dense_deviation(transport, 0, weights)
        assert rows.far[0, 0, place] == pytest.approx(expected, rel=5e-3)


def test_camera_pixels_at_the_border_are_as_uncertain_side_by_side_as_alone():
    centres = np.array([[0, 1], [11, 3], [5, 0], [0, 1], [1, 15]])
    noise = NOISE * np.random.default_rng(2).uniform(0.3, 8.0, (1, len(centres), 2))
    together = replace(in_channels(transport_at(centres), [1, 1]), noise=noise.astype(np.float32))
    light = np.random.default_rng(1).random(PROJECTOR)
    found = ErrorBars(together).picture(light)
    for c, i in np.ndindex(noise.shape[1:]):
        alone = transport_at(centres[c : c + 1], noise=noise[0, c, i])
        np.testing.assert_allclose(found[0, c, i], ErrorBars(alone).picture(light), rtol=1e-5)


def test_each_of_several_lights_has_its_own_errors():
    transport = in_channels(transport_at(np.array([[6, 8], [0, 1], [5, 7], [11, 3]])), [1, 2])
    q = transport.correspondence.copy()
    q[0, 2] = np.nan
    second = np.full_like(q, np.nan)
    second[0, :2] = [[2.4, 13.7], [9.1, 3.2]]
    of_second = np.full(transport.direct.shape, 0.2, np.float32)
    assert_each_light_has_its_own_errors(
        replace(transport, correspondence=q, second_place=second, second_direct=of_second)
    )


@pytest.mark.parametrize("lit", [True, False])
def test_entries_are_the_same_line_by_line_and_some_at_a_time(lit, monkeypatch):
    transport = transport_at(np.array([[6, 8], [0, 1]]), lit=lit)
    bars = ErrorBars(transport)
    rows = bars.component_rows(slice(0, 2))
    for pixel in range(2):
        lines = [bars.along(pixel, line) for line in range(PROJECTOR.height)]
        for whole, *parts in zip(rows, *lines, strict=True):
            np.testing.assert_allclose(np.concatenate(parts, axis=1), whole[pixel], rtol=1e-4)
    for entries in (1, 3 * PROJECTOR.width):
        monkeypatch.setattr(error_bars, "ENTRIES_AT_ONCE", entries)
        for whole, again in zip(rows, bars.component_rows(slice(0, 2)), strict=True):
            np.testing.assert_allclose(again, whole, rtol=1e-4)


@pytest.mark.parametrize(("pixel", "line"), [(2, 0), (-1, 0), (0, PROJECTOR.height), (0, -1)])
def test_what_is_not_there_has_no_error_bars(pixel, line):
    bars = ErrorBars(transport_at(np.array([[6, 8], [0, 1]])))
    with pytest.raises(InputError, match="choose one that it has"):
        bars.along(pixel, line)


def test_an_unlit_camera_pixel_has_far_light_alone():
    centres = np.array([[6, 8], [0, 0]])
    bars = ErrorBars(transport_at(centres, lit=False))
    assert not bars.direct().any()
    rows = bars.component_rows(slice(0, 2))
    assert not rows.direct.any()
    assert not rows.near.any()
    assert (rows.far > 0).all()
    light = np.random.default_rng(1).random(PROJECTOR)
    np.testing.assert_array_equal(bars.picture(light), bars.picture(light, direct=3.0, near=0.0))


def test_gains_scale_the_error_of_their_component():
    transport = transport_at(np.array([[6, 8], [5, 7]]))
    bars = ErrorBars(transport)
    light = np.random.default_rng(1).random(PROJECTOR)
    direct = bars.picture(light, near=0.0, far=0.0)
    q = transport.correspondence[0].astype(int)
    np.testing.assert_allclose(direct[0], bars.direct()[0, :, 0] * light[q[:, 0], q[:, 1]], 1e-5)
    whole = bars.picture(light)
    np.testing.assert_allclose(bars.picture(light, direct=2, near=2, far=2), 2 * whole, rtol=1e-5)
    none = bars.picture(light, direct=0, near=0, far=0)
    assert not none.any()


def test_colour_lights_go_channel_by_channel():
    transport = transport_at(np.array([[6, 8], [5, 7]]))
    both = in_channels(transport, [1, 2])
    lights = np.random.default_rng(1).random((*PROJECTOR, 2))
    found = ErrorBars(both).picture(lights)
    one, bars = ErrorBars(both), ErrorBars(transport)
    np.testing.assert_allclose(found[..., 0], bars.picture(lights[..., 0]), rtol=1e-5)
    np.testing.assert_allclose(found[..., 1], 2 * bars.picture(lights[..., 1]), rtol=1e-5)
    np.testing.assert_allclose(one.picture(lights[..., 0])[..., 1], found[..., 0] * 2, rtol=1e-5)


def test_q_between_pixels_is_as_uncertain_as_dense_algebra_says():
    part = 0.4
    transport = transport_at(np.array([[6.0, 8.0 + part]]))
    posterior = transport.posterior
    basis = real_basis(posterior.frequencies, PROJECTOR)
    at = 6 * PROJECTOR.width + 8
    one, other = basis.patterns[:, at], basis.patterns[:, at + 1]
    on_window = basis.patterns_at(window_offsets(WINDOW) + np.array([6, 8]))
    own = np.stack([np.ones(basis.count), (1 - part) * one + part * other, other - one], axis=1)
    responses = np.concatenate([own, on_window, np.eye(basis.count)], axis=1).astype(float)
    end = 3 + WINDOW**2
    s = SCALE * WHITE
    prior = np.zeros((responses.shape[1], responses.shape[1]))
    prior[:3, :3] = np.diag(prior_variance()[:3])
    prior[3:end, 3:end] = s**2 * near_covariance(COMPONENT, WINDOW, PROJECTOR)
    prior[end:, end:] = s**2 * np.diag(far_variance(basis, COMPONENT))
    noise = np.diag(NOISE**2 / posterior.multiplicity.astype(np.float64))
    gain = prior @ responses.T @ np.linalg.inv(responses @ prior @ responses.T + noise)
    posterior = prior - gain @ responses @ prior
    light = np.zeros(PROJECTOR)
    light[:, 9:] = 1.0
    weights = weights_of_picture(transport, 0, light)
    # White's own error stands apart: nothing else tells of it.
    ask = np.concatenate([weights[:1], [part - light.mean(), 1.0], weights[3:]])
    own_of_white = LIGHT**2 - (SHARE * OFFSET) ** 2
    spectrum = np.abs(np.fft.fft2(light)) ** 2
    cycles = [np.fft.fftfreq(side) * side for side in PROJECTOR]
    unseen = spectral_density(np.hypot(cycles[0][:, None], cycles[1]), COMPONENT) * spectrum
    unseen[(np.abs(cycles[0])[:, None] <= 1) & (np.abs(cycles[1]) <= 1)] = 0.0
    variance = ask @ posterior @ ask + light.mean() ** 2 * own_of_white
    variance += s**2 * unseen.sum() / PROJECTOR.pixels**2
    found = ErrorBars(transport).picture(light)[0, 0]
    assert found == pytest.approx(np.sqrt(variance), rel=2e-3)


def test_a_second_place_is_as_uncertain_as_dense_algebra_says():
    second, of_light = (2.4, 13.7), 0.2
    transport = transport_at(np.array([[6, 8]]))
    transport = replace(
        transport,
        second_place=np.array([[second]], np.float32),
        second_direct=np.full((1, 1, 1), of_light, np.float32),
    )
    posterior = transport.posterior
    basis = real_basis(posterior.frequencies, PROJECTOR)

    def at_second(values):
        """Return values (P, m) at the second place, and half of their changes by half a pixel."""

        def at(y, x):
            where = footprint(np.array([(y, x)]), PROJECTOR)
            return where.weights[0] @ values[where.pixels[0]]

        (y, x), step = second, error_bars_of_joint.HALF_STEP
        down, across = at(y + step, x) - at(y - step, x), at(y, x + step) - at(y, x - step)
        return np.stack([at(y, x), down / (2 * step), across / (2 * step)])

    direct = basis.patterns[:, 6 * PROJECTOR.width + 8]
    on_window = basis.patterns_at(window_offsets(WINDOW) + np.array([6, 8]))
    own = np.column_stack([np.ones(basis.count), direct, at_second(basis.patterns.T).T])
    responses = np.concatenate([own, on_window, np.eye(basis.count)], axis=1).astype(float)
    end = own.shape[1] + WINDOW**2
    s = SCALE * WHITE
    prior = np.zeros((responses.shape[1], responses.shape[1]))
    shift = error_bars_of_joint.SECOND_SHIFT * of_light
    prior[:5, :5] = np.diag(
        [*prior_variance()[:2], (DIRECT_PRIOR_DEVIATION * WHITE) ** 2, shift**2, shift**2]
    )
    prior[5:end, 5:end] = s**2 * near_covariance(COMPONENT, WINDOW, PROJECTOR)
    prior[end:, end:] = s**2 * np.diag(far_variance(basis, COMPONENT))
    noise = np.diag(NOISE**2 / posterior.multiplicity.astype(np.float64))
    gain = prior @ responses.T @ np.linalg.inv(responses @ prior @ responses.T + noise)
    posterior = prior - gain @ responses @ prior
    light = _held_light(transport)
    weights = weights_of_picture(transport, 0, light)
    of_second = at_second(light.reshape(-1, 1))[:, 0]
    of_second[0] -= light.mean()
    # White's own error stands apart: nothing else tells of it.
    ask = np.concatenate([weights[[0, 2]], of_second, weights[3:]])
    own_of_white = LIGHT**2 - (SHARE * OFFSET) ** 2
    expected = np.sqrt(ask @ posterior @ ask + light.mean() ** 2 * own_of_white)
    found = ErrorBars(transport).picture(light)[0, 0]
    assert found == pytest.approx(error_bars_of_joint.SECOND_WIDENING * expected, rel=2e-3)
    assert found > 1.05 * ErrorBars(transport_at(np.array([[6, 8]]))).picture(light)[0, 0]


def test_nothing_is_known_of_saturated_camera_pixels():
    transport = transport_at(np.array([[5.0, 7.0], [3.0, 4.0]]))
    known, light = ErrorBars(transport), np.random.default_rng(0).random(PROJECTOR)
    saturated = np.array([[False, True]])
    quality = Quality(np.ones((1, 2), np.float32), saturated)
    bars = ErrorBars(replace(transport, quality=quality))
    for found, before in (
        (bars.picture(light), known.picture(light)),
        (bars.direct()[..., 0], known.direct()[..., 0]),
    ):
        np.testing.assert_array_equal(np.isinf(found), saturated)
        np.testing.assert_array_equal(found[~saturated], before[~saturated])
    for row, before in zip(bars.component_rows(slice(0, 2)), known.along(0, 4), strict=True):
        assert np.isinf(row[1]).all()
        np.testing.assert_array_equal(row[0].reshape(-1, *PROJECTOR)[:, 4], before)
    # No NaN, also where there is no direct light.
    dark = replace(transport_at(np.array([[5.0, 7.0], [3.0, 4.0]]), lit=False), quality=quality)
    assert np.isinf(ErrorBars(dark).direct()[0, 1]).all()


def test_a_transport_without_posterior_says_so():
    transport = replace(transport_at(np.array([[6, 8]])), posterior=None)
    with pytest.raises(InputError, match="`method='joint'`"):
        ErrorBars(transport)
    assert transport_at(np.array([[6, 8]])).with_gains(near=2.0).posterior is None


def _within(error, deviation):
    return float(np.mean(np.abs(error) < deviation))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cornell", "alcove"])
def test_the_truth_lies_within_one_deviation_as_often_as_it_should(name):
    scene = cached_scene(name, Size(32, 32))
    plan, _ = choose_plan(scene.projector, 100)
    rig = SimulatedRig(scene, name, SimulatedProjector(), SimulatedCamera(), 1.0, 0)
    measurements = measure(acquire_in_memory(plan, rig))
    found = estimate_jointly(
        measurements, scene.correspondence, plan.window, plan.far, pitch=plan.pitch
    )
    bars = ErrorBars(found)
    shares = {}
    for light, values in standard_lights(scene.projector).items():
        truth = scene @ values
        error = (found @ values).reshape(truth.shape) - truth
        shares[light] = _within(error, bars.picture(values).reshape(truth.shape))
    pictures = np.mean([share for light, share in shares.items() if light.startswith("picture")])
    for share in (shares["white"], shares["random"], pictures):
        assert 0.6 < share < 0.76, shares
    model = fit_model(scene, plan.window, found.far_basis, found.correspondence)
    lit = found.lit
    direct = _within((found.direct - model.direct)[lit], bars.direct()[lit])
    assert 0.55 < direct < 0.8
    chosen = np.random.default_rng(0).choice(np.flatnonzero(lit), 60, replace=False)
    within = {"near": [], "far": []}
    for c in chosen:
        pixel = slice(c, c + 1)
        deviations, mine, truth = (t.component_rows(pixel) for t in (bars, found, model))
        for part, shares_of in within.items():
            sigma = getattr(deviations, part)
            error = getattr(mine, part) - getattr(truth, part)
            shares_of.append(_within(error[sigma > 0], sigma[sigma > 0]))
    assert 0.5 < np.mean(within["near"]) < 0.85
    assert 0.5 < np.mean(within["far"]) < 0.85
